//! Enums whose variants have names that parameters, command lines, messages and files use.

use thiserror::Error;

/// The error for a name that is not one of the expected ones.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("unknown {kind} {name:?}: expected one of {expected}")]
pub struct UnknownName {
    /// What the text should name, such as a law.
    pub kind: &'static str,
    /// The unknown text.
    pub name: String,
    /// The known names.
    pub expected: String,
}

#[macro_export]
/// Defines an enum whose variants have names. Generates `NAMES`, `name`, `Display` and `FromStr`.
macro_rules! named {
    (
        $(#[$about:meta])*
        $kind:literal $enum:ident { $($(#[$doc:meta])* $variant:ident = $name:literal,)* }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $enum { $($(#[$doc])* $variant,)* }

        impl $enum {
            /// The names of all variants.
            pub const NAMES: &'static [&'static str] = &[$($name),*];

            /// Returns the variant's name.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }
        }

        impl std::fmt::Display for $enum {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $enum {
            type Err = $crate::UnknownName;
            fn from_str(name: &str) -> std::result::Result<Self, Self::Err> {
                match name {
                    $($name => Ok(Self::$variant),)*
                    other => Err($crate::UnknownName {
                        kind: $kind,
                        name: other.to_owned(),
                        expected: Self::NAMES.join(", "),
                    }),
                }
            }
        }
    };
}
