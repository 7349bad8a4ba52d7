// Types that the modules of the page share. The first part describes messages of the server: see scene.rs, stage.rs and the
// other files beside this folder.

/** Two, three or more numbers. */
type Vec2 = [number, number];
type Vec3 = [number, number, number];
type Vec = ArrayLike<number>;

/** The canvas of a graph. */
interface CanvasFacts { size_mm: Vec2; resolution: Vec2; tile: [boolean, boolean] }

/** A parameter of the graph; its values are texts in RON. */
interface Param {
  name: string;
  type: string;
  value: string;
  default: string;
  range: Vec2 | null;
  unit: string | null;
  /** The heading under which it stands. */
  group?: string | null;
  doc: string;
  options: string[];
  /** The text of its declaration around the default. */
  before: string;
  after: string;
}

/** A picture that the server announces. */
interface Shown {
  target: string;
  /** Its address, which is also the name of its content. */
  picture: string;
  size: Vec2;
  final: boolean;
  range: Vec2;
  type: string;
  unit: string;
  /** True if its pixels have no position on the canvas. */
  own: boolean;
  generation?: number;
}

/** The graph that is shown. */
interface Scene {
  generation: number;
  sha256: string;
  canvas: CanvasFacts;
  breaks: { node: string; message: string; help: string | null }[];
  outputs: { name: string; type: string }[];
  presets: string[];
  params: Param[];
  pictures: Record<string, Shown>;
  nodes: number;
  mesh?: string | null;
  solid: boolean;
  /** Outputs whose files are bodies. */
  bodies: string[];
}

/** An error or a warning, with some lines of the file around it. */
interface Complaint {
  code: string;
  message: string;
  help: string | null;
  file: string;
  line: number;
  column: number;
  end_line: number;
  end_column: number;
  lines: { n: number; text: string }[];
  related: { file: string; line: number; column: number; message: string }[];
}

/** The node that is computed, its own progress if it tells it, the share of all work, and the seconds so far. */
interface Progress { node: string | null; part: number | null; share: number; seconds: number }
interface Done { generation: number; ran: number; first_ms: number; all_ms: number }

/** The preset and the values that the user chose, as the server has them. */
interface SentValues { preset: string | null; set: [string, string][]; edits: FieldEdit[] }
/** A value in the text of a node, in RON; `index` counts the numbers of a formula. */
interface FieldEdit { node: string; field: string; index?: number | null; value: string }
/** The same in the page. Both kinds of `set` are lists of pairs. */
interface Values { preset: string | null; set: Map<string, string> | [string, string][]; edits?: FieldEdit[] }

/** The state of the server. */
interface State {
  file: string;
  /** The graph; in fact null until the file was sound for the first time. Modules that need it look at this before. */
  scene: Scene;
  /** True if texts of an editor are shown that are not saved, false if all are; null if no editor follows the graph. */
  unsaved?: boolean | null;
  values: Values;
  errors: Complaint[];
  warnings: Complaint[];
  busy: boolean;
  progress: Progress | null;
  done: Done | null;
}

/** News of an export. */
type ExportNews = { id: string } & (
  | { state: 'running'; done: number; total: number }
  | { state: 'done'; name: string; bytes: number }
  | { state: 'failed'; message: string }
  | { state: 'cancelled' }
);

/** A value that a fit found. */
interface FoundValue { value: number | string; error: number; determined: boolean; unit: string | null }
/** News of a fit: see serve/photo.rs. */
type FitNews = { id: number } & (
  | { state: 'running'; done: number; total: number; best: number | null; floor: number | null; set: [string, string][] }
  | {
    state: 'done';
    name: string;
    set: [string, string][];
    report: { distance: number; floor: number | null; width_mm: number | null; width_fitted: boolean; parameters: Record<string, FoundValue> };
  }
  | { state: 'failed'; message: string }
  | { state: 'cancelled' }
);

/** Points, or lines with their ends and whether they are whole, in mm. */
interface Sketch {
  size_mm: Vec2;
  count: number;
  unit?: string;
  note?: string | null;
  own?: boolean;
  points?: Vec2[] | null;
  lines?: [number, number, number, number, number?][] | null;
}

/** A value in the text of a node, or a formula with numbers: every second one of its pieces. A node that is a formula has no name for it. `fixed` values stand in another file than the graph's; `now` is the value of a computed number. */
interface Constant { name: string; text: string; fixed?: boolean; now?: number | null; formula?: string[] | null; choices?: string[] | null; whole?: boolean; min?: number | null; max?: number | null; unit?: string | null; doc: string }

/** The server's description of a target. */
interface About {
  node: string;
  kind: string;
  doc: string;
  text: string;
  /** The file of a node that is not in the graph's file. */
  file?: string | null;
  channel?: string | null;
  channels?: string[] | null;
  fields: Constant[];
  shown?: Shown | null;
  object?: string | null;
}

/** The cost of a node, and where its result came from. */
interface Stat { name: string; state: 'computed' | 'disk' | 'memory' | 'folded' | 'unused'; seconds: number }

/** A box of the graph. */
interface Box {
  name: string;
  label: string;
  kind: string;
  line?: number;
  column: number;
  row: number;
  x: number;
  y: number;
  ports: { name: string; type: string }[];
  color?: string | null;
  index?: number | null;
  output?: number | null;
  members?: number[];
  use?: boolean;
  outside?: boolean;
  shown: boolean;
  broken?: string | null;
  /** The name of its group in the text. */
  group?: string | null;
}
interface GraphWire { from: number; to: number; bends: Vec2[]; color?: string | null; output?: string; port?: string; type?: string | null }

/** Values of a point of the picture. */
interface Probe { mm: Vec2; values: number[]; type: string; unit: string; srgb?: number[] | null }

/** Charts, borders and directions on a mesh. */
interface MeshMarks {
  seams: number[];
  strokes: number[];
  ends: number[];
  singular: number[];
  charts: number[];
  parts: number[];
  names: string[];
  triangles: number[];
}

/** Samples of a channel: bytes of the form `rgba8`, `r16f` or `r32f`. */
interface Samples { width: number; height: number; form: string; scale?: number; data: ArrayBuffer }

// The second part describes what modules of the page give each other.

/** Vertices of eleven numbers, and triangles. */
interface Mesh { data: Float32Array<ArrayBuffer>; index: Uint32Array<ArrayBuffer> }

/** A shape that carries the material: see shapes.js. */
interface Shape {
  make: (fineness: number) => Mesh;
  view: Vec3;
  foot?: number;
  span?: number;
  solid?: string;
  /** True if it is shown without the material. */
  plain?: boolean;
  /** Of the graph's mesh: the length of one mm, and the position of its middle. */
  perMm?: number;
  middle?: number[];
}

/** The report of a body: see docs/bodies.md. */
interface BodyReport {
  kind: string;
  size_mm: number[];
  triangles: number;
  error_mm?: number;
  volume_mm3: number | null;
  area_mm2: number;
  height_mm?: Vec2;
  thinnest_mm?: number;
  thinnest_at_mm?: number[] | null;
  steepest_deg?: number;
  tool?: { diameter_mm: number; left_mm: number; left_at_mm: number[] } | null;
  findings: { message: string }[];
}

/** The point of a mesh that a ray meets. */
interface Hit { at: Vec3; normal: Vec3; triangle: number; weights: Vec3 }
/** The point of the graph's mesh under the cursor. */
interface Hover { mm: Vec3; uv: Vec2; triangle?: number; part?: string; chart?: number }

/** A texture of the lit view: see textures.js. */
interface Texture { texture: WebGLTexture | null; channels: string[]; scale: number; range: Vec2 }
interface LoadedTexture extends Texture { id: string; of: string; size: number }
interface Worn<T extends Texture = LoadedTexture> { maps: Partial<Record<string, T>>; mm: Vec2 }
/** The target of a channel, the name of its content, and the solid from which it is cut. */
interface ChannelMap { t: string; id: string; solid?: string }
type ChannelMaps = Record<string, ChannelMap>;

/** The rows of a matrix that turns vectors. */
type Turn = [Vec3, Vec3, Vec3];
/** An environment: see environment.js. */
interface Light {
  bytes: ArrayBuffer; texture: WebGLTexture | null; levels: Float32Array; diffuse: Float32Array;
  key: Vec3; keyLight: Float32Array; keyColor: Float32Array;
}
/** Light around the shape; without `light`, that of the lamp. With `level`, the horizon of the environment is level. */
interface Lighting { light: Light | null; level: boolean; turn: number; key: Vec2; exposure: number }
type Uniforms = (name: string) => WebGLUniformLocation | null;

/** Values of a picture, by rows, with the channels of a pixel together. */
interface PictureValues { width: number; height: number; channels: number; type: string; unit?: string; data: Float32Array }

/** A picture as it is shown, with its values once they are known. */
interface Source {
  image: ImageBitmap;
  range: Vec2 | null;
  type: string;
  unit: string;
  own?: boolean;
  label?: string;
  /** Exact values. */
  samples?: PictureValues | null;
  /** Values that were decoded from the image. */
  decoded?: PictureValues;
  toned?: OffscreenCanvas;
  tonedKey?: string;
}

interface Tone { range: Vec2 | null; exposure: number; heat: boolean; contours: number }

/** A line on the picture, in pixels; `open` once it has a length. */
type Line = [Vec2, Vec2] & { open?: boolean };

/** A step of the history. */
interface Look {
  values: Values;
  label: string;
  sha: string | null;
  group?: string | null;
  own?: boolean;
  external?: boolean;
  parent: Look | null;
  next?: Look;
  pictures: Record<string, Shown>;
  number: number;
  target?: string;
  canvas?: HTMLCanvasElement;
  paint?: () => void;
}

/** The view of a shape as it is written into a shared file: see share.js. */
interface Shared {
  maps: Record<string, { image: string; range?: Vec2; scale?: number }>;
  mm: Vec2;
  shape: string;
  mesh: { data: string; index: string; perMm: number | null; span: number | null } | null;
  relief: string;
  values: Record<string, number>;
  turn: number;
  tilt: number;
  distance: number;
  level: boolean;
  back: Vec3;
  behind: boolean;
  light: string | null;
}

/** The state that modules share: see app.js. */
interface Page {
  /** The state of the server; in fact null until its first message. Modules that may run earlier look at this before. */
  state: State;
  view: string;
  /** The selected target; in fact null until there is a graph. */
  target: string;
  about: About | null;
  shown: Partial<Shown> | null;
  waiting: boolean;
  picture: import('./picture.js').Picture;
  wire: import('./wire.js').Wire;
  lit: import('./lit.js').Lit;
  graph: import('./nodes.js').Graph;
  parameters: import('./params.js').Parameters;
  looks: import('./looks.js').Looks;
  overlay: import('./overlay.js').Overlay;
  slots?: import('./slots.js').Slots;
  tabs: import('./tabs.js').Tabs;
  controls: ReturnType<typeof import('./controls.js').controls>;
  sharpen: () => void;
}

/** Elements of index.html that are more than an `HTMLElement`. */
interface Elements {
  picture: HTMLCanvasElement;
  lit: HTMLCanvasElement;
  rulers: HTMLCanvasElement;
  graph: HTMLCanvasElement;
  find: HTMLInputElement;
  keys: HTMLDialogElement;
  graphs: HTMLDialogElement;
  more: HTMLSelectElement;
  undo: HTMLButtonElement;
  redo: HTMLButtonElement;
  save: HTMLButtonElement;
  tiling: HTMLButtonElement;
}

/** Properties of an element, as `element` takes them: numbers become texts. */
type Props<E> = { [P in Exclude<keyof E, 'dataset'>]?: E[P] extends string | null ? string | number | null : E[P] } & { dataset?: Record<string, string> };
type Child = Node | string | null | undefined;

/** The global scope of the shared worker in stream.js; the library of types for pages lacks it. */
declare const SharedWorkerGlobalScope: { new (): object } | undefined;
