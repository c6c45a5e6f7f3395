//! `export dbc`.

use super::{ALL, Bench};

#[test]
fn dbc_has_names_units_factors_and_types() {
    let bench = Bench::of(ALL);
    let dbc = bench.run("export dbc all").exit(0).stdout;
    for line in [
        "BU_: Node1 Node2 Node3 Node127\n",
        "BO_ 385 Node1_TPDO1: 5 Node1\n SG_ pressure : 0|32@1- (1,0) [0|0] \"bar\" Vector__XXX\n \
         SG_ pressure_status : 32|8@1+ (1,0) [0|0] \"\" Vector__XXX\n",
        "SIG_VALTYPE_ 385 pressure : 1;\n",
        "BO_ 386 Node2_TPDO1: 4 Node2\n SG_ pressure : 0|32@1- (0.001,0) [0|0] \"bar\" Vector__XXX\n",
        " SG_ ch2 : 16|16@1- (0.1,0) [0|0] \"degC\" Vector__XXX\n",
        "CM_ BU_ Node127 \"DPS\";\n",
    ] {
        assert!(dbc.contains(line), "{line}{dbc}");
    }
    assert_eq!(dbc.matches("SIG_VALTYPE_ ").count(), 2, "integers are not listed\n{dbc}");
}

#[test]
fn missing_nodes_and_json_are_errors() {
    let bench = Bench::of("mh4@1");
    let done = bench.run("export dbc 1,9").exit(7);
    assert!(done.stdout.contains("BO_ 385 Node1_TPDO1") && done.stderr.contains("node 9"), "{done:?}");
    assert_eq!(bench.run("export dbc 9").exit(3).stdout, "");
    bench.run("export dbc 1 --format csv").refuses("a DBC is text: omit --format");
}
