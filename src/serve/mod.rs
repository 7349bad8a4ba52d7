//! The page of `shibo watch`: a small server on the loopback interface.
//!
//! A request must contain the token of the address and must have been sent to exactly this address: Host, and Origin if
//! present, are compared. Requests never supply a path on disk. All is read-only except parameter values and the graph
//! file, which is changed only while its content is the one the page has seen, and by the editor while it follows the graph.
mod app;
mod assets;
mod body;
mod buffers;
mod change;
mod connections;
mod data;
#[cfg(test)]
pub(crate) mod defective;
mod editor;
mod edits;
mod environment;
mod events;
mod export;
mod export_slots;
mod folder;
mod follow;
mod forecast;
mod guard;
mod handlers;
mod map;
mod marks;
mod mesh;
mod panorama;
mod photo;
mod photographs;
mod position;
mod stage;
mod texts;
mod thumb;
mod token;
mod values;
mod wear;

pub(crate) use app::Wish;
pub(crate) use buffers::{LONGEST_TEXT, TextsByPath};
pub(crate) use edits::tried;
pub(crate) use forecast::Forecast;
pub(crate) use position::SourcePosition;
pub(crate) use stage::Stage;
pub(crate) use texts::sha256;
pub(crate) use values::Values;

use crate::quit::Quit;
use guard::Guard;
use std::io::ErrorKind;
use std::process::{Command, Stdio};
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::runtime::Runtime;

/// A running server.
pub(crate) struct Server {
    /// Address of the page.
    pub(crate) url: String,
    runtime: Runtime,
}

impl Server {
    /// Stops the server.
    pub(crate) fn stop(self) {
        self.runtime.shutdown_background();
    }
}

/// Serves `stage` on a port. `wishes` receives what pages ask of the watch loop and returns whether it was accepted; `jump` receives the source positions of clicked nodes.
pub(crate) fn start(
    port: u16,
    stage: Arc<Stage>,
    wishes: impl Fn(Wish) -> bool + Send + Sync + 'static,
    jump: impl Fn(&SourcePosition) + Send + Sync + 'static,
) -> Result<Server, Quit> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .max_blocking_threads(16)
        .thread_name("shibo-page")
        .enable_all()
        .build()
        .map_err(|e| Quit::failed(format!("cannot start the server of the page: {e}")))?;
    let listener = runtime.block_on(TcpListener::bind(("127.0.0.1", port))).map_err(|e| match e.kind() {
        ErrorKind::AddrInUse => {
            Quit::failed(format!("port {port} is in use; name another with --port, or leave it out to take a free one"))
        }
        ErrorKind::PermissionDenied => Quit::failed(format!(
            "port {port} may not be used; name one above 1023, or leave it out to take a free one"
        )),
        _ => Quit::failed(format!("cannot listen on port {port}: {e}")),
    })?;
    let token = token::token(port)?;
    let port = listener.local_addr().map_err(|e| Quit::failed(format!("cannot listen: {e}")))?.port();
    let url = format!("http://127.0.0.1:{port}/{token}/");
    let app = handlers::router(stage, (Arc::new(wishes), Arc::new(jump)), Guard::new(port, &token));
    runtime.spawn(connections::accept(listener, app));
    Ok(Server { url, runtime })
}

/// Asks the system to open a page in the browser. Without a browser, the user finds the address on the terminal.
pub(crate) fn open_browser(url: &str) {
    let (program, args): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("cmd", &["/C", "start", ""])
    } else {
        ("xdg-open", &[])
    };
    let child = Command::new(program)
        .args(args)
        .arg(url)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if let Ok(mut child) = child {
        // Waiting for the child process keeps it from becoming a zombie.
        std::thread::spawn(move || child.wait());
    }
}
