//! Lists the steps of `config apply` without executing them (`--dry-run`).

use super::apply::{Options, targets};
use super::check::{FileSettings, Wanted};
use super::order::{service_words, sorted, tpdo_settings};
use super::setting::{Form, Stage};
use super::snapshot::Snapshot;
use super::value::Content;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::tasks::Note;
use crate::tasks::pdo;
use std::collections::BTreeSet;

/// One step.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The node.
    pub node: NodeId,
    /// The keys of the settings that the step belongs to.
    pub key: String,
    /// The step.
    pub step: Step,
}

/// A step.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Writes an object.
    Write {
        /// The object.
        object: ObjectId,
        /// Its type.
        data_type: DataType,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// Sets the node-ID.
    SetId(NodeId),
    /// Sets the bit rate, in bit/s.
    SetBitRate(u32),
    /// Stores everything.
    Store,
}

/// Returns the steps of `config apply` in their order, and the notes about it.
///
/// If the unit changes, the device may convert other values by itself; the steps then list all of them.
pub fn lines(file: &FileSettings, before: &Snapshot, options: &Options) -> (Vec<Line>, Vec<Note>) {
    let (targets, notes) = targets(file, before, options);
    let differs = |wanted: &Wanted| before.content(&wanted.setting).as_ref() != Some(&wanted.content);
    let rescales = targets.iter().any(|wanted| wanted.setting.stage <= Stage::Digits && differs(wanted));
    let is_written =
        |wanted: &&Wanted| differs(wanted) || rescales && matches!(wanted.setting.form, Form::Quantity(..));
    let node = before.node.id;
    let stages: BTreeSet<Stage> = targets.iter().map(|wanted| wanted.setting.stage).collect();
    let mut lines = Vec::new();
    for stage in stages {
        let all: Vec<Wanted> = targets.iter().filter(|wanted| wanted.setting.stage == stage).cloned().collect();
        let group: Vec<Wanted> = all.iter().filter(is_written).cloned().collect();
        let keys = |object: Option<ObjectId>| {
            let own = group.iter().filter(|wanted| object.is_none_or(|object| wanted.setting.object == object));
            own.map(|wanted| wanted.entry.key.clone()).collect::<Vec<_>>().join(", ")
        };
        let word = |object, value: u32, width: usize| {
            let bytes = value.to_le_bytes()[..width].to_vec();
            let data_type = DataType::Unsigned(u8::try_from(width).unwrap_or(4));
            Step::Write { object, data_type, bytes }
        };
        match stage {
            Stage::Tpdo(number) => {
                let Some(old) = before.tpdo(number) else { continue };
                let steps = pdo::steps(&before.node, old, &tpdo_settings(old, &all));
                let line = |step: pdo::StepWrite| Line {
                    node,
                    key: keys(None),
                    step: word(step.object, step.value, step.width),
                };
                lines.extend(steps.into_iter().map(line));
            }
            Stage::Service => {
                for (object, words) in service_words(&all, before) {
                    let line = |value: u32| Line { node, key: keys(Some(object)), step: word(object, value, 4) };
                    lines.extend(words.into_iter().map(line));
                }
            }
            _ => lines.extend(sorted(group, before).into_iter().filter_map(|wanted| {
                let step = match (wanted.content, &wanted.setting.form) {
                    (Content::Bytes(bytes), _) => {
                        Step::Write { object: wanted.setting.object, data_type: wanted.setting.data_type, bytes }
                    }
                    (Content::Number(id), Form::NodeId) => Step::SetId(NodeId::new(u8::try_from(id).ok()?).ok()?),
                    (Content::Number(rate), _) => Step::SetBitRate(rate),
                    (Content::Mapping(_), _) => return None,
                };
                Some(Line { node, key: wanted.entry.key, step })
            })),
        }
    }
    if options.store {
        let at = lines.iter().position(|line| matches!(line.step, Step::SetId(_) | Step::SetBitRate(_)));
        lines.insert(at.unwrap_or(lines.len()), Line { node, key: String::new(), step: Step::Store });
    }
    (lines, notes)
}
