//! Whole numbers on the command line.

use std::ops::RangeInclusive;

/// Returns a parser for a whole number in this range. Errors of the parser name the range.
pub(super) fn count<T: TryFrom<u64>>(
    range: RangeInclusive<u64>,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let (least, most) = (range.start(), range.end());
        let most = if *most == u64::MAX { "on".to_owned() } else { format!("to {most}") };
        number
            .and_then(|number| T::try_from(number).ok())
            .ok_or_else(|| format!("expected a whole number from {least} {most}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_counts_are_rejected_with_the_valid_range() {
        let tasks = count::<u32>(1..=10);
        assert_eq!((tasks("1"), tasks("10")), (Ok(1), Ok(10)));
        for text in ["0", "11", "-1", "", "1.0", "1e1", "ten", "99999999999999999999"] {
            assert_eq!(tasks(text), Err("expected a whole number from 1 to 10".to_owned()), "{text}");
        }
        assert_eq!(count::<u64>(5..=u64::MAX)("4"), Err("expected a whole number from 5 on".to_owned()));
        assert_eq!(count::<u64>(0..=u64::MAX)("18446744073709551615"), Ok(u64::MAX));
    }
}
