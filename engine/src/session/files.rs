//! Lists the files that a render would write, without writing them.
use super::plan::wanted;
use super::render::{Render, RenderRequest, window};
use super::{Failure, Session};
use crate::eval::{CancelToken, Observer};
use crate::graph::Graph;
use crate::value::Key;
use std::path::PathBuf;

impl Session {
    /// The files that a render would write, with the keys of their content. An export of several files counts as its
    /// main file.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn files(
        &self,
        graph: &Graph,
        request: &RenderRequest,
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Vec<(PathBuf, Key)>, Failure> {
        let wanted = wanted(graph, &request.outputs)?;
        let window = window(graph, request)?;
        self.run(graph, cancel, observer, |run| {
            let render = Render::new(self, run, (graph, request), observer, window);
            Ok(render.pictures(&wanted)?.into_iter().map(|picture| (picture.path, picture.key)).collect())
        })
    }
}
