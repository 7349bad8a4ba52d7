//! Searches nodes by description, or by their names in other programs.
use shibo_ide::manual::doc::summary;
use shibo_ide::manual::elsewhere;
use shibo_node::KindInfo;
use shibo_node::registry::Registry;

/// A kind that was found, its first sentence, and its names in other programs if they are the reason.
#[derive(Debug, PartialEq, Eq)]
pub struct Found<'r> {
    /// The kind.
    pub kind: &'r str,
    /// The first sentence of its manual.
    pub summary: String,
    /// Its names in other programs, if they are the reason.
    pub elsewhere: Option<String>,
}

/// Names of a kind in other programs, in one line.
fn names_elsewhere(doc: &str) -> String {
    elsewhere::paragraph(doc).split_whitespace().collect::<Vec<_>>().join(" ").replace('*', "")
}

/// The letters and digits in lower case, in American spelling: `ColorRamp` and `colour ramp` are then equal.
fn squash(text: &str) -> String {
    elsewhere::squash(text).replace("colour", "color").replace("grey", "gray")
}

/// The words of a text in lower case; names of kinds are split at their capitals.
fn words_of(text: &str) -> Vec<String> {
    let mut spaced = String::with_capacity(text.len() + 16);
    let mut before = ' ';
    for c in text.chars() {
        if c.is_uppercase() && before.is_lowercase() {
            spaced.push(' ');
        }
        spaced.push(c);
        before = c;
    }
    spaced.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(squash).collect()
}

/// Number of these words with which a word of a text begins.
pub(crate) fn count_words(words: &[String], text: &str) -> usize {
    let known = words_of(text);
    words.iter().filter(|word| known.iter().any(|one| one.starts_with(word.as_str()))).count()
}

/// The words of a query.
pub(crate) fn query_words(query: &str) -> Vec<String> {
    query.split_whitespace().map(squash).filter(|word| !word.is_empty()).collect()
}

/// Rank of a kind for a query, lower is better: 0 to 3 for the whole query, and 4 plus the number of words that are missing.
/// `None` if no word matches.
fn rank(query: &str, kind: &str, summary: &str, elsewhere: &str) -> Option<(usize, usize)> {
    let (whole, name) = (squash(query), squash(kind));
    let words = query_words(query);
    if words.is_empty() {
        return None;
    }
    let rank = if name.starts_with(&whole) {
        0
    } else if name.contains(&whole) {
        1
    } else if elsewhere.split([',', ';', '.']).any(|one| squash(one).contains(&whole)) {
        2
    } else if squash(summary).contains(&whole) && words.len() > 1 {
        3
    } else {
        match count_words(&words, &format!("{kind} {summary} {elsewhere}")) {
            0 => return None,
            count => 4 + words.len() - count,
        }
    };
    Some((rank, name.len()))
}

/// Kinds that match a query, the best first. If none has all its words, those with the most.
pub fn search<'r>(registry: &'r Registry, query: &str) -> Vec<Found<'r>> {
    let kinds =
        registry.kinds().filter_map(|kind| registry.info(kind)).map(|info: &KindInfo| (&*info.kind, &*info.doc));
    let mut found = Vec::new();
    let words = shibo_ide::manual::words::WORDS.iter().map(|word| (word.name, &*word.doc));
    for (kind, doc) in kinds.chain(words) {
        let (summary, names) = (summary(doc), names_elsewhere(doc));
        if let Some(rank) = rank(query, kind, &summary, &names) {
            let elsewhere = (matches!(rank.0, 2 | 4..) && !names.is_empty()).then_some(names);
            found.push((rank, Found { kind, summary, elsewhere }));
        }
    }
    let most = found.iter().map(|((rank, _), _)| *rank).min().unwrap_or_default().max(4);
    found.retain(|((rank, _), _)| *rank <= most);
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.kind.cmp(b.1.kind)));
    found.into_iter().map(|(_, found)| found).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    #[test]
    fn finds_names_of_other_programs() {
        let doc = "Does a thing.\n\nElsewhere: Substance Designer *Tile Sampler*, Material Maker *Tiler*.";
        assert_eq!(names_elsewhere(doc), "Substance Designer Tile Sampler, Material Maker Tiler.");
        assert_eq!(names_elsewhere("Nothing."), "");
    }

    #[test]
    fn manuals_list_names_in_other_programs() {
        let registry = shibo_library::registry();
        let pairs = [
            ("ColorRamp", "GradientMap"),
            ("Node Group", "Use"),
            ("Instance on Points", "Each"),
            ("Voronoi Texture", "Worley"),
            ("Principled BSDF", "Material"),
            ("Musgrave", "Fractal"),
            ("Poisson Disk", "PoissonPoints"),
            ("Transformation 2D", "Transform"),
        ];
        for (query, kind) in pairs {
            let found = search(&registry, query);
            assert!(found.iter().any(|found| found.kind == kind), "{query}: {found:?}");
        }
    }

    #[test]
    fn finds_kinds_with_most_of_the_words() {
        let registry = shibo_library::registry();
        let kinds = |query: &str| search(&registry, query).into_iter().map(|found| found.kind).collect::<Vec<_>>();
        // No manual has both words.
        assert!(!kinds("overlapping scales").is_empty());
        // Words are found by their beginnings.
        assert_eq!(count_words(&query_words("over scales"), "Scales that overlap"), 2);
        assert_eq!(count_words(&query_words("lap"), "Scales that overlap"), 0);
        assert!(kinds("zzzz").is_empty());
    }

    /// Stages of the methods for leather, wood and synthesis, which no other program has as nodes.
    const WITHOUT: [&str; 37] = [
        "AppearanceSpace",
        "BlendTimes",
        "BranchTime",
        "BudEyes",
        "CandidateSets",
        "ColorPattern",
        "CoordsFromField",
        "CorrectCoords",
        "DefineMass",
        "DetectLattice",
        "DistanceTime",
        "DrawMeshWrinkles",
        "DrawWrinkles",
        "Emboss",
        "EqualizeHeight",
        "FiberSpace",
        "FiberStreaks",
        "FitSkeleton",
        "IndirectionMap",
        "JacobianFromAngleScale",
        "JacobianFromMesh",
        "JacobianFromVectors",
        "JacobianFromWarp",
        "JacobianMultiply",
        "JitterCoords",
        "LayerTime",
        "MagnifyCoords",
        "PlaceWrinkles",
        "StartCoords",
        "StraightTime",
        "Tree",
        "TrunkTime",
        "UpsampleCoords",
        "VaryGrowth",
        "WoodPores",
        "WoodRays",
        "WorkArea",
    ];

    #[test]
    fn finds_every_kind_by_its_listed_names() {
        let registry = shibo_library::registry();
        for kind in registry.kinds() {
            let doc = registry.info(kind).unwrap().doc.clone();
            let paragraph = elsewhere::paragraph(&doc);
            if paragraph.is_empty() {
                assert!(WITHOUT.contains(&kind), "`{kind}` does not say what it is called elsewhere");
                continue;
            }
            assert!(!WITHOUT.contains(&kind), "`{kind}` says what it is called elsewhere");
            let names: Vec<&str> = paragraph.split('*').skip(1).step_by(2).collect();
            assert!(!names.is_empty(), "`{kind}` names no node of another program");
            for name in names {
                let found = search(&registry, name);
                assert!(found.iter().any(|found| found.kind == kind), "`{name}` does not find `{kind}`");
            }
        }
    }

    #[test]
    fn ranks_nearest_match_first() {
        let rank = |query: &str| rank(query, "GradientMap", "Colours by value.", "Blender ColorRamp, Houdini Ramp.");
        assert_eq!(rank("gradient").map(|r| r.0), Some(0));
        assert_eq!(rank("Map").map(|r| r.0), Some(1));
        assert_eq!(rank("colour ramp").map(|r| r.0), Some(2));
        assert_eq!(rank("colors by").map(|r| r.0), Some(3));
        assert_eq!(rank("value ramp").map(|r| r.0), Some(4));
        // A match across the names of two nodes comes last.
        assert_eq!(rank("ramp hou").map(|r| r.0), Some(4));
        assert_eq!(rank("spring"), None);
        assert_eq!(rank(" "), None);
    }
}
