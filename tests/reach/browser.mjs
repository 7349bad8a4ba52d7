// A headless Chromium, driven through the pipe of its DevTools protocol, and a server of a folder.
import { spawn } from "node:child_process";
import { createReadStream, existsSync, mkdtempSync, rmSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join, normalize } from "node:path";

const NAMES = ["chromium", "chromium-browser", "google-chrome", "chrome"];
const TYPES = { ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml", ".png": "image/png", ".wasm": "application/wasm", ".txt": "text/plain" };

/** The path of a browser; `undefined` if there is none. */
export function found() {
  const folders = (process.env.PATH ?? "").split(":");
  return NAMES.flatMap((name) => folders.map((folder) => join(folder, name))).find((path) => existsSync(path));
}

/** Serves a folder as any static host does; gives the address. */
export async function serve(folder) {
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, "http://x").pathname));
    let file = join(folder, path);
    if (existsSync(file) && statSync(file).isDirectory()) file = join(file, "index.html");
    if (!existsSync(file)) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream", "content-length": statSync(file).size });
    createReadStream(file).pipe(response);
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}

export class Browser {
  constructor() {
    this.profile = mkdtempSync(join(tmpdir(), "shibo-browser-"));
    const options = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--mute-audio", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
    this.child = spawn(found(), [...options, "--remote-debugging-pipe", "--disable-background-networking", `--user-data-dir=${this.profile}`, "about:blank"], {
      stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"],
    });
    this.count = 0;
    this.waiting = new Map();
    this.pages = new Map();
    let rest = "";
    this.child.stdio[4].setEncoding("utf8").on("data", (data) => {
      const parts = (rest + data).split("\0");
      rest = parts.pop();
      for (const part of parts) this.hear(JSON.parse(part));
    });
  }

  hear(message) {
    if (message.id === undefined) {
      this.pages.get(message.sessionId)?.hear(message);
      return;
    }
    const { resolve, reject } = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if (message.error) reject(new Error(JSON.stringify(message.error)));
    else resolve(message.result);
  }

  call(method, params = {}, sessionId) {
    this.count += 1;
    const id = this.count;
    const answer = new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
    this.child.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return answer;
  }

  /** Opens a page in a window of its own, because hidden tabs draw nothing. */
  async open(url, { width = 1280, height = 800, watched = true } = {}) {
    const { browserContextId } = await this.call("Target.createBrowserContext");
    const { targetId } = await this.call("Target.createTarget", { url: "about:blank", browserContextId, newWindow: true });
    const { sessionId } = await this.call("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page(this, sessionId, browserContextId);
    this.pages.set(sessionId, page);
    // Watching the network makes large files slow.
    for (const domain of ["Runtime", "Log", "Page", ...(watched ? ["Network"] : [])]) await page.call(`${domain}.enable`);
    await page.size(width, height);
    await page.call("Page.navigate", { url });
    return page;
  }

  async close() {
    await this.call("Browser.close").catch(() => {});
    await new Promise((done) => (this.child.exitCode === null ? this.child.once("exit", done) : done()));
    rmSync(this.profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 100 });
  }
}

class Page {
  constructor(browser, session, context) {
    this.browser = browser;
    this.context = context;
    this.session = session;
    /** Errors of the console. */
    this.complaints = [];
    /** Addresses of all requests. */
    this.requests = [];
  }

  hear({ method, params }) {
    if (method === "Runtime.exceptionThrown") this.complaints.push(params.exceptionDetails.exception?.description ?? JSON.stringify(params));
    if (method === "Runtime.consoleAPICalled" && params.type === "error") this.complaints.push(params.args.map((one) => one.value ?? one.description).join(" "));
    if (method === "Log.entryAdded" && params.entry.level === "error") this.complaints.push(`${params.entry.text} ${params.entry.url ?? ""}`);
    if (method === "Network.requestWillBeSent") this.requests.push(params.request.url);
  }

  call(method, params) {
    return this.browser.call(method, params, this.session);
  }

  size(width, height) {
    return this.call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
  }

  /** The value of an expression. */
  async eval(expression) {
    const { result, exceptionDetails } = await this.call("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description ?? exceptionDetails.text} ${JSON.stringify(exceptionDetails.exception?.preview ?? "")}`);
    return result.value;
  }

  /** Waits until an expression is true. */
  async wait(expression, longest = 60_000) {
    const end = Date.now() + longest;
    for (;;) {
      const value = await this.eval(`((value) => (value instanceof Node ? true : value))(${expression})`).catch(() => null);
      if (value) return value;
      if (Date.now() > end) throw new Error(`never true: ${expression}; complaints: ${this.complaints.join("\n")}`);
      await new Promise((done) => setTimeout(done, 20));
    }
  }

  /** Types a text where the focus is. */
  type(text) {
    return this.call("Input.insertText", { text });
  }

  async key(key, { code = key, modifiers = 0, keyCode = 0 } = {}) {
    const text = key.length === 1 && !modifiers ? key : undefined;
    for (const type of ["keyDown", "keyUp"]) await this.call("Input.dispatchKeyEvent", { type, key, code, modifiers, text, windowsVirtualKeyCode: keyCode || key.toUpperCase().charCodeAt(0) });
  }

  async move(x, y) {
    await this.call("Input.dispatchMouseEvent", { type: "mouseMoved", x, y });
  }

  async click(x, y) {
    for (const type of ["mousePressed", "mouseReleased"]) await this.call("Input.dispatchMouseEvent", { type, x, y, button: "left", clickCount: 1 });
  }

  async picture() {
    return Buffer.from((await this.call("Page.captureScreenshot", { format: "png" })).data, "base64");
  }
}
