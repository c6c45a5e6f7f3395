//! `conform` ends at Ctrl-C with the old settings and the old state of the device.

use super::*;
use std::iter::StepBy;
use std::ops::Range;

/// Ctrl-C after some frames of each area. The device has its old settings and its old state. One test for each device,
/// so that they run in parallel.
mod some_frames {
    use super::*;

    fn all_areas(kind: &str, step: usize) {
        for area in Area::ALL {
            let store = matches!(area, Area::Eds | Area::Lss);
            let wrong = interrupted(kind, area, store, |count| (SEARCH..count).step_by(step.max(count / 15)));
            assert_eq!(wrong, [""; 0]);
        }
    }

    #[test]
    fn mh4() {
        all_areas("mh4", 37);
    }

    #[test]
    fn d20() {
        all_areas("d20", 151);
    }

    #[test]
    fn mc1609() {
        all_areas("mc1609", 151);
    }

    #[test]
    fn dps() {
        all_areas("dps", 151);
    }
}

#[test]
fn late_answer_to_an_interrupted_write_leaves_no_setting_unrestored() {
    assert_eq!(interrupted("dps", Area::Emcy, false, each), [""; 0]);
}

#[test]
fn interrupted_life_guarding_leaves_no_error() {
    // The last case but one sets the life time.
    let last = |count: usize| (count - 100..count).step_by(1);
    assert_eq!(interrupted("mc1609", Area::ErrorControl, false, last), [""; 0]);
}

/// Ctrl-C after each frame. One test for each device, so that they run in parallel.
mod every_frame {
    use super::*;

    fn all_areas(kind: &str, store: bool) {
        let wrong: Vec<String> = Area::ALL.into_iter().flat_map(|area| interrupted(kind, area, store, each)).collect();
        assert_eq!(wrong, [""; 0]);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn mh4() {
        all_areas("mh4", false);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn mh4_with_store() {
        all_areas("mh4", true);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn d20() {
        all_areas("d20", false);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn d20_with_store() {
        all_areas("d20", true);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn mc1609() {
        all_areas("mc1609", false);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn mc1609_with_store() {
        all_areas("mc1609", true);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn dps() {
        all_areas("dps", false);
    }

    #[test]
    #[ignore = "takes minutes: .ci/long interrupts"]
    fn dps_with_store() {
        all_areas("dps", true);
    }
}

/// The device works for two seconds.
fn run_on(bus: &mut MemoryBus) {
    let until = Mono::at(bus.mono().since_start() + Duration::from_secs(2));
    while bus.receive(until).expect("the bus works") != Event::Timeout {}
}

/// The first frames search the bus for other nodes.
const SEARCH: usize = 260;

/// The numbers of frames after which a check is interrupted.
type FrameNumbers = StepBy<Range<usize>>;

fn each(count: usize) -> FrameNumbers {
    (SEARCH..count).step_by(1)
}

/// Interrupts the cases of an area after each chosen frame. Returns the differences from before.
fn interrupted(kind: &str, area: Area, store: bool, chosen: impl Fn(usize) -> FrameNumbers) -> Vec<String> {
    let file = (area == Area::Eds).then(|| eds(kind, &[]));
    let options = ConformOptions { only: vec![area], store, eds: file, ..ConformOptions::default() };
    let mut clean = FaultyBus::new(bus(kind, None), Fault::None, 0);
    let before = contents(&mut clean.bus);
    run(&mut clean, kind, &options).expect("a report");
    let count = clean.sent.len();
    let mut wrong = Vec::new();
    for at in chosen(count) {
        let mut faulty = FaultyBus::new(bus(kind, None), Fault::Interrupt, at);
        let result = run(&mut faulty, kind, &options);
        let mut bus = faulty.bus;
        run_on(&mut bus);
        let mut found = differences(&mut bus, &before);
        let station = bus.stations_mut::<Deviant>().next().expect("the device");
        if station.device.is_configuring() || !station.has_old_address() {
            found.push("the device has another node-ID or bit rate, or is in configuration state".to_owned());
        }
        bus.power_cycle();
        run_on(&mut bus);
        found.extend(differences(&mut bus, &before).into_iter().map(|one| format!("after a power cycle: {one}")));
        match result {
            Ok(report) => {
                found.extend(report.not_restored.iter().map(|object| format!("not restored: {object}")));
                found.extend(report.history.map(|change| format!("{change:?}")));
            }
            Err(failure) if failure.kind() == Kind::Interrupted && failure.effects.is_empty() => {}
            Err(failure) => found.push(format!("{failure}: {:?}", failure.effects)),
        }
        if Switch::input() != Input::Normal {
            found.push("the input is not normal".to_owned());
        }
        if !found.is_empty() {
            wrong.push(format!("{kind} {area}, store {store}, {at} of {count} ({}): {found:?}", clean.sent[at]));
        }
    }
    wrong
}
