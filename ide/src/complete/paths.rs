//! Completion of file paths.
use super::{Ask, Completion, Sort, Topic};
use std::ops::Range;

/// Extensions of picture files.
const PICTURES: [&str; 7] = ["png", "jpg", "jpeg", "tif", "tiff", "exr", "hdr"];

impl Ask<'_> {
    /// Files that a node can read.
    pub(super) fn files(&mut self, typed: &str, inside: Range<usize>) -> Vec<Completion> {
        let kind = self.trail.node().and_then(|level| match level.inside {
            super::Expect::Kind(info) => Some(info.kind.as_str()),
            _ => None,
        });
        let wanted: &[&str] = match kind {
            Some("Image") => &PICTURES,
            Some("Svg") => &["svg"],
            Some("Text") => &["ttf", "otf"],
            Some("LoadMesh") => &["obj", "gltf", "glb", "bin"],
            _ => &[],
        };
        self.list(typed, inside, &|name| {
            let extension = name.rsplit_once('.').map(|(_, e)| e.to_lowercase());
            let is = |e: &str| wanted.contains(&e);
            if wanted.is_empty() { extension.as_deref() != Some("ron") } else { extension.is_some_and(|e| is(&e)) }
        })
    }

    /// Graphs that can be imported: files, and graphs of the library.
    pub(super) fn import_paths(&mut self, typed: &str, inside: Range<usize>) -> Vec<Completion> {
        let own = self.cx.file.path.file_name().map(|name| name.to_string_lossy().into_owned());
        let mut found = self.list(typed, inside.clone(), &|name| {
            name.ends_with(".ron") && (typed.contains('/') || Some(name) != own.as_deref())
        });
        self.replace = inside;
        let library = self.cx.registry().library().map_or(Vec::new(), |library| library.names());
        for name in library {
            let label = format!("shibo:{name}");
            found.push(self.offer_text(&label, Sort::File, "comes with the program", Topic::Text(String::new()), 5.0));
        }
        found
    }

    /// Folders and accepted files in a folder.
    fn list(&mut self, typed: &str, inside: Range<usize>, wanted: &dyn Fn(&str) -> bool) -> Vec<Completion> {
        let start = typed.rfind('/').map_or(0, |i| i + 1);
        self.replace = inside.start + start..inside.end;
        let folder = self.cx.file.folder().join(&typed[..start]);
        let mut found = Vec::new();
        for (name, is_folder) in self.cx.world.folder(&folder) {
            if name.starts_with('.') {
                continue;
            }
            if is_folder {
                let label = format!("{name}/");
                found.push(self.offer_text(&label, Sort::Folder, "", Topic::Text(String::new()), 2.0));
            } else if wanted(&name) {
                found.push(self.offer_text(&name, Sort::File, "", Topic::Text(String::new()), 1.0));
            }
        }
        found
    }
}
