//! Words of other programs.
use shibo_node::registry::Registry;

/// Begins the paragraph of a manual with the names of a node in other programs.
const ELSEWHERE: &str = "Elsewhere:";

/// Words of other programs, in lower case without signs, with the words for the same thing here.
const WORDS: [(&str, &[&str]); 71] = [
    ("scale", &["size", "pitch"]),
    ("frequency", &["size", "pitch"]),
    ("period", &["size", "pitch"]),
    ("cellsize", &["size", "pitch"]),
    ("spacing", &["pitch", "distance"]),
    ("interval", &["pitch"]),
    ("strength", &["amount", "depth", "opacity"]),
    ("intensity", &["amount", "strength", "depth", "opacity"]),
    ("power", &["amount"]),
    ("factor", &["amount", "opacity", "mask"]),
    ("weight", &["amount", "opacity"]),
    ("in", &["input"]),
    ("source", &["input", "base"]),
    ("src", &["input", "base"]),
    ("image", &["input", "path"]),
    ("texture", &["input"]),
    ("value", &["input"]),
    ("color", &["base_color", "input"]),
    ("albedo", &["base_color"]),
    ("diffuse", &["base_color"]),
    ("basecolor", &["base_color"]),
    ("rough", &["roughness"]),
    ("metal", &["metallic"]),
    ("metalness", &["metallic"]),
    ("displacement", &["height"]),
    ("bump", &["height"]),
    ("occlusion", &["ao"]),
    ("ambientocclusion", &["ao"]),
    ("background", &["base", "bottom"]),
    ("bottom", &["base"]),
    ("a", &["base"]),
    ("b", &["top"]),
    ("foreground", &["top"]),
    ("blend", &["mode", "opacity"]),
    ("blendmode", &["mode"]),
    ("blendtype", &["mode"]),
    ("operation", &["mode"]),
    ("type", &["mode", "shape"]),
    ("alpha", &["opacity"]),
    ("mix", &["opacity", "amount"]),
    ("sigma", &["radius"]),
    ("blur", &["radius"]),
    ("distance", &["radius", "width"]),
    ("thickness", &["width"]),
    ("linewidth", &["width"]),
    ("rotation", &["angle"]),
    ("direction", &["angle"]),
    ("rotate", &["angle"]),
    ("detail", &["octaves"]),
    ("levels", &["octaves", "iterations"]),
    ("steps", &["iterations", "octaves"]),
    ("persistence", &["gain"]),
    ("roughnessgain", &["gain"]),
    ("dimension", &["gain"]),
    ("jitter", &["randomness", "jitter"]),
    ("random", &["seed", "randomness"]),
    ("randomseed", &["seed"]),
    ("stretch", &["aspect"]),
    ("anisotropy", &["aspect"]),
    ("ramp", &["stops"]),
    ("colors", &["stops"]),
    ("gradient", &["stops"]),
    ("filename", &["path"]),
    ("file", &["path"]),
    ("parameters", &["params"]),
    ("variables", &["params"]),
    ("exports", &["outputs"]),
    ("results", &["outputs"]),
    ("graph", &["nodes"]),
    ("description", &["doc"]),
    ("units", &["unit"]),
];

/// The words here for a word of other programs, in lower case without signs.
pub(super) fn meanings(word: &str) -> &'static [&'static str] {
    WORDS.iter().find(|(known, _)| *known == word).map_or(&[], |(_, here)| here)
}

/// The letters and digits of a text, in lower case.
pub(super) fn squash(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The kinds that a manual says to have this name in another program, or that have its words in another order.
pub(super) fn kinds_elsewhere<'r>(registry: &'r Registry, word: &str) -> Vec<&'r str> {
    let (squashed, own) = (squash(word), parts(word));
    let called = |kind: &str| {
        registry.info(kind).is_some_and(|info| names_elsewhere(&info.doc).any(|name| squash(name) == squashed))
    };
    let is_meant = |kind: &&str| (own.len() > 1 && parts(kind) == own) || called(kind);
    registry.kinds().filter(is_meant).collect()
}

/// The names between asterisks in the paragraph about other programs.
fn names_elsewhere(doc: &str) -> impl Iterator<Item = &str> {
    let paragraph = doc.split("\n\n").map(str::trim).find_map(|paragraph| paragraph.strip_prefix(ELSEWHERE));
    paragraph.unwrap_or_default().split('*').skip(1).step_by(2)
}

/// The words of a name such as `BlendMaterials`, in singular, sorted.
fn parts(name: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for c in name.chars().take(64).filter(|c| c.is_alphanumeric()) {
        if c.is_uppercase() || parts.is_empty() {
            parts.push(String::new());
        }
        if let Some(part) = parts.last_mut() {
            part.extend(c.to_lowercase());
        }
    }
    parts.iter_mut().for_each(|part| part.truncate(part.trim_end_matches('s').len()));
    parts.sort();
    parts
}
