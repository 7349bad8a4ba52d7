//! Templates of `shibo new`, which are graphs of the library.

/// A template.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Template {
    /// The name.
    pub(crate) name: &'static str,
    /// Description, one line.
    pub(crate) doc: &'static str,
    /// The file.
    pub(crate) text: &'static str,
}

/// All templates.
pub(crate) const TEMPLATES: &[Template] = &[
    Template {
        name: "starter",
        doc: "one layer of leather, every line explained",
        text: include_str!("../graphs/starter.ron"),
    },
    Template {
        name: "leather",
        doc: "a full-grain calf: fine grain, folds and pores",
        text: include_str!("../graphs/leather.ron"),
    },
    Template {
        name: "noise",
        doc: "noises and what can be made of them",
        text: include_str!("../graphs/noise_basics.ron"),
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_import_no_files() {
        for template in TEMPLATES {
            // A copy has no folder `lib` beside it.
            assert!(!template.text.contains("imports:"), "{}", template.name);
        }
    }
}
