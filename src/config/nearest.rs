//! The name that was meant.

/// The name among `known` that looks most like `name`, if one does.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let best = known.into_iter().max_by_key(|known| shared_pairs(known, name))?;
    (2 * shared_pairs(best, name) >= best.len()).then_some(best)
}

/// How many pairs of neighbouring characters of `a` are in `b` too.
fn shared_pairs(a: &str, b: &str) -> usize {
    a.as_bytes().windows(2).filter(|pair| b.as_bytes().windows(2).any(|other| other == *pair)).count()
}
