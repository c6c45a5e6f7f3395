//! One deviation for each case of the area "eds": of the file, or of the device.

use super::deviant::Deviation::{self, Answers, Sends};
use super::table::{abort, ack, is, read, reply, with};
use cangauge::canopen::id::CanId;

/// A device, the case that finds the deviation, the texts that are replaced in its EDS file, and the deviation of the
/// device.
pub(super) type EdsRow = (&'static str, &'static str, &'static [(&'static str, &'static str)], Option<Deviation>);

pub(super) const EDS: &[EdsRow] = &[
    ("mh4", "EDS-01", &[("AccessType=rw\n", "AccessType=rx\n")], None),
    (
        "mh4",
        "EDS-02",
        &[
            ("SupportedObjects=3\n1=0x1000\n2=0x1001\n3=0x1018", "SupportedObjects=2\n1=0x1000\n2=0x1018"),
            (
                "[1001]\nParameterName=error-register\nObjectType=0x7\nDataType=0x0005\nAccessType=ro\nPDOMapping=0\n\
                 DefaultValue=0\n",
                "",
            ),
        ],
        None,
    ),
    (
        "mh4",
        "EDS-03",
        &[("=producer-heartbeat-time\nObjectType=0x7\nDataType=0x0006", "=heartbeat\nObjectType=0x7\nDataType=0x0003")],
        None,
    ),
    (
        "mh4",
        "EDS-04",
        &[("DefaultValue=4\nLowLimit=1\nHighLimit=4\n", "DefaultValue=4\nLowLimit=1\nHighLimit=3\n")],
        None,
    ),
    ("mh4", "EDS-05", &[("VendorNumber=0x47", "VendorNumber=0x48")], None),
    ("mh4", "EDS-06", &[("DefaultValue=MH-4-CAN", "DefaultValue=MH-5-CAN")], None),
    (
        "mh4",
        "EDS-10",
        &[],
        Some(Answers(|_, request| is(request, &[0x40, 0x00, 0x71, 1]).then(|| abort(request, 0x0609_0011)))),
    ),
    (
        "mh4",
        "EDS-11",
        &[],
        Some(Answers(|_, request| is(request, &[0x40, 0x02, 0x10, 0]).then(|| reply(0x43, request, [1; 4])))),
    ),
    ("mh4", "EDS-12", &[], Some(Sends(|memory, frame| read(memory, frame, [0x00, 0x71, 1], |data| data[0] = 0x43)))),
    ("mh4", "EDS-13", &[], Some(Answers(|_, request| is(request, &[0x2b, 0x10, 0x61, 1]).then(|| ack(request))))),
    (
        "mh4",
        "EDS-14",
        &[],
        Some(Answers(|_, request| is(request, &[0x40, 0x23, 0x20, 1]).then(|| reply(0x4b, request, [1, 0, 0, 0])))),
    ),
    (
        "mh4",
        "EDS-15",
        &[],
        Some(Answers(|_, request| is(request, &[0x23, 0x36, 0x61, 1]).then(|| abort(request, 0x0601_0002)))),
    ),
    ("mh4", "EDS-16", &[], Some(Answers(|_, request| is(request, &[0x2f, 0x32, 0x61, 2, 6]).then(|| ack(request))))),
    (
        "mc1609",
        "EDS-17",
        &[],
        Some(Answers(|_, request| is(request, &[0x2b, 0x01, 0x18, 5, 99]).then(|| ack(request)))),
    ),
    (
        "mh4",
        "EDS-18",
        &[(
            "heartbeat-time\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nPDOMapping=0\nDefaultValue=0\n",
            "heartbeat-time\nObjectType=0x7\nDataType=0x0006\nAccessType=rw\nPDOMapping=0\nDefaultValue=1000\n",
        )],
        None,
    ),
    (
        "mh4",
        "EDS-19",
        &[],
        Some(Answers(|_, request| {
            is(request, &[0x23, 0x00, 0x1a, 1, 0x10, 1, 0x00, 0x71]).then(|| abort(request, 0x0604_0041))
        })),
    ),
    (
        "mh4",
        "EDS-20",
        &[],
        Some(Answers(|_, request| is(request, &[0x23, 0x00, 0x1a, 1, 0x10, 0, 0x17, 0x10]).then(|| ack(request)))),
    ),
    // An UNSIGNED8 in place of an UNSIGNED16.
    (
        "mh4",
        "EDS-21",
        &[],
        Some(Answers(|_, request| is(request, &[0x40, 0x17, 0x10, 255]).then(|| reply(0x43, request, [7, 5, 0, 0])))),
    ),
    ("mc1609", "LSS-28", &[("BaudRate_20=1", "BaudRate_20=0")], None),
    ("dps", "LSS-28", &[("BaudRate_1000=1", "BaudRate_1000=0")], None),
    (
        "mc1609",
        "LSS-28",
        &[],
        Some(Sends(|memory, frame| {
            let is_answer = frame.id() == CanId::LSS_SLAVE && memory.lss[..3] == [0x13, 0, 8];
            if is_answer { with(frame, |data| data[1] = 1) } else { vec![frame] }
        })),
    ),
];
