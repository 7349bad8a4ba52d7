//! Parameters that choose one of a kernel's variants.

/// Declares an enum for graph files whose variants are those of a kernel's enum, of the same names.
macro_rules! choice {
    ($(#[$meta:meta])* $name:ident = $kernel:ty { $($(#[$variant_meta:meta])* $variant:ident,)* }) => {
        $(#[$meta])*
        #[derive(
            Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
        )]
        pub enum $name { $($(#[$variant_meta])* $variant,)* }

        impl From<$name> for $kernel {
            fn from(choice: $name) -> Self {
                match choice { $($name::$variant => Self::$variant,)* }
            }
        }
    };
}

pub(crate) use choice;
