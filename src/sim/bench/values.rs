//! Reads values of a bench file as types of other layers.

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::scalar::Scalar;
use serde::{Deserialize, Deserializer, de::Error};

impl<'de> Deserialize<'de> for NodeId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<NodeId, D::Error> {
        NodeId::new(u8::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

impl<'de> Deserialize<'de> for ObjectId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<ObjectId, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Plain {
    Integer(i64),
    Real(f64),
    Text(String),
}

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Scalar, D::Error> {
        Ok(match Plain::deserialize(deserializer)? {
            Plain::Integer(number) => Scalar::Integer(number),
            Plain::Real(number) => Scalar::Real(number),
            Plain::Text(text) => Scalar::from(text.as_str()),
        })
    }
}
