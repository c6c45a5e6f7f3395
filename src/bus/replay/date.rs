//! Dates in the headers of recordings, as several tools write them in several languages.
//!
//! A date with an unknown word or with two meanings is no date: the times then count from the start of the recording.

use super::text::{TimeZone, milliseconds, number, seconds};
use std::time::Duration;

/// The first letters of the months in English, German, French, Italian, Spanish, Portuguese, Dutch and Swedish. Letters
/// that are not ASCII may be unreadable.
const MONTHS: [&[&str]; 12] = [
    &["jan", "gen", "ene"],
    &["feb", "f\u{e9}v", "f\u{fffd}v", "fev"],
    &["mar", "m\u{e4}r", "m\u{fffd}r", "mrt"],
    &["apr", "avr", "abr"],
    &["may", "mai", "maj", "mag", "mei"],
    &["jun", "juin", "giu"],
    &["jul", "juil", "lug"],
    &["aug", "ao\u{fb}", "ao\u{fffd}", "aou", "ago"],
    &["sep", "set"],
    &["oct", "okt", "ott", "out"],
    &["nov"],
    &["dec", "dez", "d\u{e9}c", "d\u{fffd}c", "dic"],
];

/// Words for the first and the second half of the day.
const HALVES: [&[&str]; 2] = [
    &["am", "a.m.", "vorm.", "\u{4e0a}\u{5348}", "\u{5348}\u{524d}"],
    &["pm", "p.m.", "nachm.", "\u{4e0b}\u{5348}", "\u{5348}\u{5f8c}"],
];

/// A date and time as time since 1970: `Tue Nov 14 10:13:20.250 pm 2023`, `14.11.2023 22:13:20.250`,
/// `11/14/2023 10:13:20 PM`, `2023-11-14 22:13:20`.
pub(super) fn date(text: &str, zone: TimeZone) -> Option<Duration> {
    let (mut day, mut time, mut is_afternoon, mut has_unknown_word) = (Day::default(), None, None, false);
    for word in text.split_ascii_whitespace() {
        let word = word.to_lowercase();
        if let Some(half) = HALVES.iter().position(|words| words.contains(&word.as_str())) {
            is_afternoon = Some(half == 1);
        } else if word.contains(':') {
            time = Some(time_of_day(&word)?);
        } else {
            has_unknown_word |= !day.take(&word, time.is_some()) && time.is_some();
        }
    }
    let ([mut hour, minute, second], fraction) = time?;
    match is_afternoon {
        Some(afternoon) if hour <= 12 => hour = hour % 12 + if afternoon { 12 } else { 0 },
        // The unknown word may be the half of the day.
        None if has_unknown_word && hour <= 12 => return None,
        _ => {}
    }
    let [year, month, day] = day.fields(is_afternoon.is_some())?;
    let is_valid = (1..=12).contains(&month) && (1..=31).contains(&day) && hour < 24 && minute < 60 && second <= 60;
    let seconds = zone([year, month, day, hour, minute, second]).filter(|_| is_valid)?;
    Some(Duration::from_secs(seconds) + fraction)
}

/// `22:13:20.250`: hour, minute and second, and the fraction of the second.
fn time_of_day(word: &str) -> Option<([i32; 3], Duration)> {
    let (time, part) = word.split_once('.').unwrap_or((word, "0"));
    let time: Vec<i32> = time.split(':').map(small).collect::<Option<_>>()?;
    // Three digits are milliseconds. python-can writes no leading zeros.
    let is_milliseconds = part.split('.').next().is_some_and(|digits| digits.len() <= 3);
    let fraction = if is_milliseconds { milliseconds(part)? } else { seconds(&format!("0.{part}"))? };
    Some((time.try_into().ok()?, fraction))
}

/// The parts of a day that were read so far.
#[derive(Default)]
struct Day {
    year: Option<i32>,
    month: Option<i32>,
    day: Option<i32>,
    /// `11/14/2023` or `14/11/2023`: the two numbers before the year.
    with_slashes: Option<[i32; 2]>,
}

impl Day {
    /// Takes a word of the date, before or after the time. Returns whether its meaning is known.
    fn take(&mut self, word: &str, has_time: bool) -> bool {
        let numbers = |separator| match word.split(separator).map(small).collect::<Vec<_>>()[..] {
            [Some(one), Some(two), Some(three)] => Some([one, two, three]),
            _ => None,
        };
        if let Some([day, month, year]) = numbers('.') {
            (self.year, self.month, self.day) = (Some(year), Some(month), Some(day));
        } else if let Some([year, month, day]) = numbers('-').or_else(|| numbers('/').filter(|it| it[0] > 31)) {
            (self.year, self.month, self.day) = (Some(year), Some(month), Some(day));
        } else if let Some([one, two, year]) = numbers('/') {
            (self.year, self.with_slashes) = (Some(year), Some([one, two]));
        } else if let Some(number) = small(word.trim_end_matches('.')) {
            *if number > 31 { &mut self.year } else { &mut self.day } = Some(number);
        } else if self.year.is_none() {
            // The month follows the name of the day, which may look like a month: `mar.` is also a French Tuesday.
            let month = month(word);
            self.month = month.or(self.month.filter(|_| has_time));
            return month.is_some();
        } else {
            return false;
        }
        true
    }

    /// Year, month and day. Without AM or PM, `5/11/2023` has two meanings.
    fn fields(&self, has_half: bool) -> Option<[i32; 3]> {
        let (month, day) = match self.with_slashes {
            None => (self.month?, self.day?),
            Some([day, month]) if day > 12 || day == month => (month, day),
            Some([month, day]) if day > 12 || has_half => (month, day),
            Some(_) => return None,
        };
        Some([self.year?, month, day])
    }
}

/// The number of a month by its name, or from `11\u{6708}`.
fn month(word: &str) -> Option<i32> {
    let named = MONTHS.iter().zip(1..).find(|(names, _)| names.iter().any(|it| word.starts_with(it)));
    named.map(|(_, month)| month).or_else(|| small(word.strip_suffix('\u{6708}')?))
}

fn small(text: &str) -> Option<i32> {
    number(text).filter(|_| !text.is_empty()).and_then(|number| i32::try_from(number).ok())
}

#[cfg(test)]
mod tests {
    use super::super::text::test_zone;
    use super::*;

    #[test]
    fn dates_of_several_tools() {
        let expected = Duration::from_millis(((13 * 86_400) + 22 * 3_600 + 13 * 60 + 20) * 1000 + 250);
        let expected = expected + Duration::from_secs(10 * 31 * 86_400);
        for text in [
            "Tue Nov 14 10:13:20.250 pm 2000",
            "Die Nov 14 22:13:20.250 2000",
            "Di. 14. Nov. 22:13:20.250 2000",
            "mar. nov. 14 10:13:20.250 p.m. 2000",
            "\u{5468}\u{4e8c} 11\u{6708} 14 10:13:20.250 \u{4e0b}\u{5348} 2000",
            "Tue Nov 14 22:13:20.250 CET 2000",
            "14.11.2000 22:13:20.250",
            "11/14/2000 10:13:20.250 PM",
            "14/11/2000 22:13:20.250",
            "2000/11/14 22:13:20.250",
            "2000-11-14 22:13:20.250000",
        ] {
            assert_eq!(date(text, test_zone), Some(expected), "{text}");
        }
        let noon = |text| date(text, test_zone).map(|time| time.as_millis());
        assert_eq!(noon("Sam Jan 1 12:00:00 am 2000"), Some(0));
        assert_eq!(noon("Sat Jan 1 12:00:00.5 pm 2000"), Some(43_200_005));
        assert_eq!(noon("1.1.2000 00:00:00.484.3"), Some(484));
        assert_eq!(noon("Mit M\u{fffd}r 1 00:00:00 2000"), Some(2 * 31 * 86_400_000));
        for wrong in [
            "",
            "Nov 14 22:13:20",
            "22:13:20 2000",
            "Nov 14 2000",
            "Tue Nov 14 22:13:20:00:00 2000",
            "14.13.2000 22:13:20",
        ] {
            assert_eq!(date(wrong, test_zone), None, "{wrong}");
        }
    }

    #[test]
    fn months_in_several_languages() {
        for (text, month) in [
            ("mar. f\u{e9}vr. 1", 2),
            ("mar f\u{fffd}v 1", 2),
            ("jeu d\u{e9}c 1", 12),
            ("ven ao\u{fb}t 1", 8),
            ("lun juil. 1", 7),
            ("lun juin 1", 6),
            ("mar mars 1", 3),
            ("mar gen 1", 1),
            ("gio giu 1", 6),
            ("jue ene 1", 1),
            ("di mei 1", 5),
        ] {
            let expected = Duration::from_secs((month - 1) * 31 * 86_400);
            assert_eq!(date(&format!("{text} 00:00:00 2000"), test_zone), Some(expected), "{text}");
        }
        // The first word is a Tuesday, and not March.
        assert_eq!(date("mar lis 1 00:00:00 2000", test_zone), None);
    }

    #[test]
    fn dates_with_two_meanings_are_no_dates() {
        assert_eq!(date("5/11/2000 22:13:20", test_zone), None);
        assert!(date("5/5/2000 22:13:20", test_zone).is_some());
        assert_eq!(date("Tue Nov 14 10:13:20 x 2000", test_zone), None, "the half of the day is unknown");
    }
}
