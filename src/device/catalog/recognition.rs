//! Recognises a device by its answers. Only the descriptions that may fit are parsed.

use super::{FILES, IdentityAnswers, Model, file, identify, own};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::description::Identify;
use std::sync::Arc;

impl Identify {
    /// Whether 1000h, 1018h and 1008h agree with the description. [`Model::is_confirmed`] checks the other objects.
    pub(super) fn agrees_with(&self, traits: &IdentityAnswers) -> bool {
        fn agrees<T: PartialEq>(wanted: &Option<T>, found: &Option<T>) -> bool {
            wanted.is_none() || wanted == found
        }
        !self.is_empty()
            && agrees(&self.device_type, &traits.device_type)
            && agrees(&self.vendor_id, &traits.vendor_id)
            && agrees(&self.product_code, &traits.product_code)
            && agrees(&self.device_name, &traits.device_name)
    }

    /// How specific the description is: the number of its identity keys, then the number of other objects to compare. A
    /// more specific description has priority.
    fn rank(&self) -> (usize, usize) {
        (self.identity_count(), self.confirm.len())
    }
}

impl Model {
    /// Whether the objects that confirm the identity have the required values. Bytes after the width of the type are
    /// ignored, because a server that omits the size sends four bytes.
    fn is_confirmed(&self, traits: &IdentityAnswers) -> bool {
        self.description.identify.confirm.iter().all(|(&object, value)| {
            let wanted = self.dictionary.get(object).and_then(|entry| value.encode(entry.data_type, NodeId::MIN).ok());
            match (wanted, traits.answers.get(&object)) {
                (Some(wanted), Some(found)) => found.starts_with(&wanted),
                _ => false,
            }
        })
    }
}

/// A description of the user, or a built-in one, which is parsed only if a device may fit.
#[derive(Clone, Copy)]
enum Candidate {
    Own(&'static Arc<Model>),
    /// The index of the file in [`FILES`].
    BuiltIn(usize),
}

impl Candidate {
    /// Every description: the user's, then the built-in ones with other names.
    fn all() -> impl Iterator<Item = Candidate> {
        let is_replaced = |index: &usize| own().iter().any(|own| own.description.name == FILES[*index].0);
        let built_in = (0..FILES.len()).filter(move |index| !is_replaced(index));
        own().iter().map(Candidate::Own).chain(built_in.map(Candidate::BuiltIn))
    }

    fn identify(self) -> &'static Identify {
        match self {
            Candidate::Own(model) => &model.description.identify,
            Candidate::BuiltIn(index) => identify(index),
        }
    }

    fn model(self) -> Option<Arc<Model>> {
        match self {
            Candidate::Own(model) => Some(Arc::clone(model)),
            Candidate::BuiltIn(index) => file(index),
        }
    }

    /// Returns the description if it fits the answers of a device.
    fn recognised(self, traits: &IdentityAnswers) -> Option<Arc<Model>> {
        let identify = self.identify();
        let is_answered = identify.confirm.keys().all(|object| traits.answers.contains_key(object));
        if !identify.agrees_with(traits) || !is_answered {
            return None;
        }
        self.model().filter(|model| model.is_confirmed(traits))
    }
}

/// Returns the description with this vendor-ID and product code, if there is exactly one. It is used if nothing else
/// about the device is known.
pub fn by_identity(vendor: u32, product: u32) -> Option<Arc<Model>> {
    let wanted = (Some(vendor), Some(product));
    let mut fitting = Candidate::all().filter(|candidate| {
        let identify = candidate.identify();
        (identify.vendor_id, identify.product_code) == wanted
    });
    fitting.next().filter(|_| fitting.next().is_none())?.model()
}

/// Returns the objects to read before [`recognise`] can decide. Empty if no object is needed, or if no description can
/// fit. The caller reads them, and adds the received bytes to [`IdentityAnswers::answers`].
pub fn objects_to_read(traits: &IdentityAnswers) -> Vec<ObjectId> {
    // Other descriptions with the same number of identity keys cannot change the decision. Only a description with more
    // identity keys would have priority.
    let decided_keys = recognise(traits).map_or(0, |model| model.description.identify.rank().0);
    let is_undecided = |identify: &&Identify| identify.agrees_with(traits) && identify.rank().0 > decided_keys;
    let mut objects: Vec<ObjectId> = Candidate::all()
        .map(Candidate::identify)
        .filter(is_undecided)
        .flat_map(|identify| identify.confirm.keys().copied())
        .filter(|object| !traits.answers.contains_key(object))
        .collect();
    objects.sort_unstable();
    objects.dedup();
    objects
}

/// Returns the description that fits the answers of a device: a description of the user, else a built-in one. If
/// several fit, the most specific one is used. If two are equally specific, none is used.
pub fn recognise(traits: &IdentityAnswers) -> Option<Arc<Model>> {
    let best = |mut fitting: Vec<Arc<Model>>| {
        fitting.sort_by_key(|model| std::cmp::Reverse(model.description.identify.rank()));
        match &fitting[..] {
            [first, second, ..] if first.description.identify.rank() == second.description.identify.rank() => None,
            fitting => fitting.first().cloned(),
        }
    };
    let fitting = |candidates: &mut dyn Iterator<Item = Candidate>| -> Vec<Arc<Model>> {
        candidates.filter_map(|candidate| candidate.recognised(traits)).collect()
    };
    let of_user = fitting(&mut own().iter().map(Candidate::Own));
    if of_user.is_empty() { best(fitting(&mut Candidate::all())) } else { best(of_user) }
}
