/** Where the module `shibo.wasm` is: an address, its bytes, or the compiled module. */
export type Source = string | URL | ArrayBuffer | ArrayBufferView | WebAssembly.Module;

/** Files by their paths relative to the graph. */
export type Files = Record<string, Uint8Array | ArrayBuffer | string>;

/** A value of a parameter: a number, a boolean, a text (also a colour such as `#334455`), or the components of a colour. */
export type Value = number | boolean | string | number[];

export interface Picture {
  /** `OUTPUT`, or `OUTPUT.CHANNEL` for a channel of a material. */
  name: string;
  width: number;
  height: number;
  /** Numbers per pixel, 1 to 4. */
  channels: number;
  /** Exact values of the graph: rows from the top, the channels of a pixel side by side. Colours are linear Rec. 709. */
  data: Float32Array;
  /** The unit of the numbers, such as `mm`. */
  unit: string | null;
  meaning: "color" | "normal" | "number" | "data";
  /** Width and height of the canvas. */
  sizeMm: [number, number];
}

/** The values and files of a graph. */
export interface GraphOptions {
  /** Pixels of the longer side; the size in the graph by default. */
  resolution?: number;
  /** Values of parameters. */
  set?: Record<string, Value>;
  preset?: string;
  seed?: number;
  /** Files that the graph reads. Nothing else is read or fetched. */
  files?: Files;
  /** Stops the work between two pictures or files. The promise is rejected with an `AbortError`. */
  signal?: AbortSignal;
}

export interface RenderOptions extends GraphOptions {
  /** `OUTPUT` or `OUTPUT.CHANNEL`. */
  output?: string;
}

export interface WriteOptions extends GraphOptions {
  /** A program that the materials are written for, such as `gltf`; without one, the outputs as the graph states. */
  target?: string;
  /** `OUTPUT` or `OUTPUT.CHANNEL`; all by default. */
  outputs?: string[];
}

export interface WrittenFile {
  /** The name, such as `material_base_color.png`; it may have folders. */
  name: string;
  bytes: Uint8Array;
}

export interface Diagnostic {
  file: string;
  /** Lines and columns count from 1, columns in characters. */
  line: number;
  column: number;
  end_line: number;
  end_column: number;
  level: "error" | "warning";
  code: string;
  message: string;
  help: string | null;
  related: { file: string; line: number; column: number; message: string }[];
  fixes: { title: string; applies: string; edits: object[] }[];
}

export interface Param {
  name: string;
  type: "Number" | "Integer" | "Bool" | "Color" | "Text" | "Path" | "Choice";
  value: Value;
  default: Value;
  range: [number, number] | null;
  unit: string | null;
  /** The group of the panel, if the graph names one. */
  group: string | null;
  doc: string;
  options: string[] | null;
  /** The value and the default as RON, and the text before and after the default on its line. */
  source: { value: string; default: string; line: [string, string] };
}

/** A request that failed. */
export class ShiboError extends Error {
  /** The code of the protocol, such as `graph` or `no-output`. */
  code: string;
  /** Errors of the graph. */
  diagnostics: Diagnostic[];
}

/** Loads the module. The other functions load `shibo.wasm` beside this file by themselves. */
export function load(source?: Source): Promise<void>;

/** Renders one picture. `text` is a graph, or `shibo:NAME` for a shipped one. */
export function render(text: string, options: RenderOptions & { output: string }): Promise<Picture>;

/** Renders all pictures of a graph, or those of one output. */
export function renderAll(text: string, options?: RenderOptions): Promise<Record<string, Picture>>;

/** The files that `shibo render` would write. */
export function write(text: string, options?: WriteOptions): Promise<WrittenFile[]>;

/** Errors and warnings of a graph. */
export function check(text: string, files?: Files): Promise<Diagnostic[]>;

/** The parameters of a graph. */
export function params(text: string, files?: Files): Promise<Param[]>;

/** The shipped graphs. Those with `part` are for use in other graphs. */
export function graphs(): Promise<{ name: string; doc: string; part: boolean }[]>;

/** All messages of a request of the protocol. */
export function ask(request: { op: string } & Record<string, unknown>): Promise<{ json: any; bytes: Uint8Array }[]>;
