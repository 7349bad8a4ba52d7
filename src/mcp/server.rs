//! The protocol.
use super::limits::Limits;
use super::lines::Lines;
use super::tools::{Answer, TOOLS, object};
use super::{McpArgs, pages};
use crate::quit::Quit;
use crate::{environment, library};
use rmcp::model::{
    CallToolRequestParams, CallToolResponse, CallToolResult, ContentBlock, Implementation, ListResourceTemplatesResult,
    ListResourcesResult, ListToolsResult, PaginatedRequestParams, ReadResourceRequestParams, ReadResourceResponse,
    ReadResourceResult, ResourceContents, ServerCapabilities, ServerConfig, Tool, ToolAnnotations,
};
use rmcp::service::{RequestContext, ServerInitializeError};
use rmcp::{ErrorData, RoleServer, ServerHandler, ServiceExt};
use serde_json::Value as Json;
use shibo_bridge::Tools;
use shibo_bridge::agents::{Folders, State};
use shibo_engine::session::Settings;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::AsyncWrite;
use tokio::task::JoinHandle;

/// After the end of stdin, calls may end by themselves for this time. Then they are cancelled.
const PATIENCE: Duration = Duration::from_millis(300);
/// The longest wait for the answers of cancelled calls to be written, and then for their threads.
const LAST: Duration = Duration::from_millis(200);
/// The largest answer in bytes.
const ANSWER: usize = 4 << 20;
/// Bytes of the cache on disk.
const DISK: u64 = 1 << 30;

const INSTRUCTIONS: &str = "Shibo makes textures from graphs of nodes, written as text in RON. Begin with `list_graphs` and \
`describe_graph` to see graphs, and with `search_nodes` and `describe_node` to find nodes. Write a graph, `check` it until it has no \
errors, `render` it, and look at the picture. The page shibo://docs/graph-file describes the language.";

/// The server.
struct Server {
    state: Arc<State>,
    limits: Arc<Limits>,
}

/// The state for the folders and the limits of the command line.
fn state(args: &McpArgs) -> Result<State, String> {
    let folders = Folders::open(&args.read, &args.write)?;
    let cache_dir = environment::cache_dir().and_then(|dir| Some(dir.parent()?.join("shibo-mcp")));
    let (threads, memory) = (usize::from(args.threads), u64::from(args.memory) << 20);
    let settings = Settings { threads, memory, cache_dir, disk: DISK };
    Ok(State::new(Tools { import_paths: Vec::new(), ..library::tools() }, folders, settings))
}

/// Runs the server until stdin ends.
pub(super) fn run(args: &McpArgs) -> Result<(), Quit> {
    let state = Arc::new(state(args).map_err(Quit::Usage)?);
    let limits = Arc::new(Limits::new(Duration::from_secs(u64::from(args.seconds))));
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.map_err(|error| Quit::failed(format!("the server cannot start: {error}")))?;
    let served = runtime.block_on(async {
        let (lines, ended) = Lines::start(tokio::io::stdin(), tokio::io::stdout());
        serve(Server { state, limits }, lines, ended).await
    });
    // Calls that still run are dropped with the process.
    runtime.shutdown_timeout(LAST);
    served.map_err(|error| Quit::failed(format!("the connection failed: {error}")))
}

/// Serves a client until its lines have ended, and at most half a second longer.
async fn serve<W: AsyncWrite + Send + Unpin + 'static>(
    server: Server,
    lines: Lines<W>,
    ended: JoinHandle<std::io::Result<()>>,
) -> Result<(), String> {
    let running = match server.serve(lines).await {
        Ok(running) => running,
        // A client that leaves before the handshake is no failure.
        Err(ServerInitializeError::ConnectionClosed(_)) => return Ok(()),
        Err(error) => return Err(error.to_string()),
    };
    let calls = running.cancellation_token();
    let late = async {
        let _ = ended.await;
        tokio::time::sleep(PATIENCE).await;
        calls.cancel();
        tokio::time::sleep(LAST).await;
    };
    tokio::select! {
        served = running.waiting() => served.map(drop).map_err(|error| error.to_string()),
        () = late => Ok(()),
    }
}

impl ServerHandler for Server {
    fn get_info(&self) -> ServerConfig {
        let capabilities = ServerCapabilities::builder().enable_tools().enable_resources().build();
        let program = Implementation::new("shibo", env!("CARGO_PKG_VERSION"));
        ServerConfig::new(capabilities).with_server_info(program).with_instructions(INSTRUCTIONS)
    }

    async fn list_tools(
        &self,
        _request: Option<PaginatedRequestParams>,
        _context: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        let tool = |info: &super::tools::ToolInfo| {
            let hints = ToolAnnotations::new().read_only(!info.writes).open_world(false);
            let hints = if info.writes { hints.destructive(true).idempotent(true) } else { hints };
            let tool = Tool::new(info.name, info.doc, Arc::new(object((info.input)()))).with_annotations(hints);
            tool.with_raw_output_schema(Arc::new(object((info.output)())))
        };
        Ok(ListToolsResult::with_all_items(TOOLS.iter().map(tool).collect()))
    }

    async fn call_tool(
        &self,
        request: CallToolRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        let Some(tool) = TOOLS.iter().find(|tool| tool.name == request.name) else {
            let names: Vec<&str> = TOOLS.iter().map(|tool| tool.name).collect();
            let message = format!("there is no tool of this name; the tools are {}", names.join(", "));
            return Err(ErrorData::invalid_params(message, None));
        };
        let (state, run) = (self.state.clone(), tool.run);
        let arguments = Json::Object(request.arguments.unwrap_or_default());
        let work = move |cancel: &shibo_engine::eval::CancelToken| run(&state, arguments, cancel);
        let done = self.limits.clone().call(context.ct.cancelled(), work).await;
        Ok(result(done.unwrap_or_else(Answer::from)).into())
    }

    async fn list_resources(
        &self,
        _request: Option<PaginatedRequestParams>,
        _context: RequestContext<RoleServer>,
    ) -> Result<ListResourcesResult, ErrorData> {
        Ok(ListResourcesResult::with_all_items(pages::list(&self.state.tools)))
    }

    async fn list_resource_templates(
        &self,
        _request: Option<PaginatedRequestParams>,
        _context: RequestContext<RoleServer>,
    ) -> Result<ListResourceTemplatesResult, ErrorData> {
        Ok(ListResourceTemplatesResult::with_all_items(pages::templates()))
    }

    async fn read_resource(
        &self,
        request: ReadResourceRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<ReadResourceResponse, ErrorData> {
        let (state, uri) = (self.state.clone(), request.uri.clone());
        let read = self.limits.clone().call(context.ct.cancelled(), move |_| pages::read(&state.tools, &uri)).await;
        let read = read.map_err(|refusal| ErrorData::internal_error(refusal.message, None))?;
        let Some((text, mime)) = read else {
            return Err(ErrorData::resource_not_found("there is no such resource", None));
        };
        let contents = ResourceContents::text(text, request.uri).with_mime_type(mime);
        Ok(ReadResourceResult::new(vec![contents]).into())
    }
}

/// The result of a call: the same content as JSON and as text, and a picture.
fn result(answer: Answer) -> CallToolResult {
    let text = answer.json.to_string();
    let picture = answer.png.map(|png| crate::lsp::base64(&png));
    if 2 * text.len() + picture.as_ref().map_or(0, String::len) > ANSWER {
        let help = "ask for less";
        let refusal = shibo_bridge::agents::Refusal::new("too-large", "the answer is larger than 4 MiB", help);
        return result(Answer::from(refusal));
    }
    let mut content = vec![ContentBlock::text(text)];
    content.extend(picture.map(|data| ContentBlock::image(data, "image/png")));
    let mut done = if answer.is_error { CallToolResult::error(content) } else { CallToolResult::success(content) };
    done.structured_content = Some(answer.json);
    done
}
