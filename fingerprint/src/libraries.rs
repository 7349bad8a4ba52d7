//! The libraries under a package, read from the text of a `Cargo.lock`.
use std::collections::BTreeSet;

/// Name, version and checksum of every package that `package` depends on, directly or not.
pub(crate) fn under(lock: &str, package: &str) -> BTreeSet<String> {
    let value = |block: &str, key: &str| {
        let line = block.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "))?;
        Some(line.trim_matches('"').to_owned())
    };
    let blocks: Vec<(String, String, &str)> = lock
        .split("[[package]]")
        .filter_map(|block| Some((value(block, "name")?, value(block, "version")?, block)))
        .collect();
    let mut found = BTreeSet::new();
    let mut stack = vec![package.to_owned()];
    let mut seen = BTreeSet::new();
    while let Some(wanted) = stack.pop() {
        // A dependency is written `name`, or `name version` where there are several of that name.
        let mut words = wanted.split(' ');
        let (name, version) = (words.next().unwrap_or_default(), words.next());
        for (_, at, block) in blocks.iter().filter(|(n, v, _)| n == name && version.is_none_or(|version| version == v))
        {
            if !seen.insert(format!("{name} {at}")) {
                continue;
            }
            if name != package {
                found.insert(format!("{name} {at} {}", value(block, "checksum").unwrap_or_default()));
            }
            let below = block.split_once("dependencies = [").and_then(|(_, rest)| rest.split_once(']'));
            let names = below.map_or("", |(list, _)| list).split('"').skip(1).step_by(2);
            stack.extend(names.map(str::to_owned));
        }
    }
    found
}
