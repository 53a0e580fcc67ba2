//! List parameters as nodes read them.

use super::ParameterError;
use std::fmt::Display;

/// The items of a list parameter, which keep the parameter's name for what may be wrong with them.
#[derive(Clone, Debug, PartialEq)]
pub struct List<T> {
    name: &'static str,
    items: Vec<T>,
}

impl<T> List<T> {
    pub(super) fn new(name: &'static str, items: Vec<T>) -> Self {
        Self { name, items }
    }

    /// The items, however many they are.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// The error of a list that has `value` where `expected` should be.
    pub fn invalid(&self, value: impl Display, expected: impl Into<String>) -> ParameterError {
        ParameterError::Invalid { name: self.name, value: value.to_string(), expected: expected.into() }
    }
}

impl List<f64> {
    /// The numbers, of which there must be `count`.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`] for another count.
    pub fn exactly(&self, count: usize) -> Result<&[f64], ParameterError> {
        match self.items.len() {
            length if length == count => Ok(&self.items),
            length => Err(self.invalid(format!("a list of {length}"), format!("{count} numbers"))),
        }
    }

    /// The numbers, of which there must be `N`.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`] for another count.
    pub fn array<const N: usize>(&self) -> Result<[f64; N], ParameterError> {
        let numbers = <[f64; N]>::try_from(self.items.as_slice());
        numbers.map_err(|_| self.invalid(format!("a list of {}", self.items.len()), format!("{N} numbers")))
    }

    /// The numbers, of which there must be `count`; none where the list is empty.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`] for another count.
    pub fn exactly_or_none(&self, count: usize) -> Result<Option<&[f64]>, ParameterError> {
        if self.items.is_empty() { Ok(None) } else { self.exactly(count).map(Some) }
    }
}
