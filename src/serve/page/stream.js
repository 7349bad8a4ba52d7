// @ts-check
// News of the server. A shared worker holds one connection for all tabs, because browsers allow only six per server.
const KINDS = ['state', 'shown', 'errors', 'warnings', 'busy', 'progress', 'done', 'look', 'export', 'fit', 'refused'];

/** @param {(kind: string, data: string) => void} tell */
export function listen(tell) {
  /** @type {EventSource} */
  let source;
  const open = () => {
    source = new EventSource('events');
    for (const kind of KINDS) source.addEventListener(kind, (e) => tell(kind, /** @type {MessageEvent} */ (e).data));
    source.onerror = () => {
      tell('offline', 'null');
      if (source.readyState === EventSource.CLOSED) setTimeout(open, 1500);
    };
  };
  open();
}

if (typeof SharedWorkerGlobalScope !== 'undefined' && self instanceof SharedWorkerGlobalScope) {
  /** @type {Set<MessagePort>} */
  const ports = new Set();
  /** @type {string | null} */
  let state = null;
  let begun = false;
  /** @param {string} kind @param {string} data */
  const tell = (kind, data) => {
    if (kind === 'state') state = data;
    for (const port of ports) port.postMessage([kind, data]);
  };
  /** @type {{ onconnect?: (e: MessageEvent) => void }} */ (self).onconnect = (e) => {
    const port = /** @type {MessagePort} */ (e.ports[0]);
    ports.add(port);
    port.onmessage = (m) => { if (m.data === 'bye') ports.delete(port); };
    if (!begun) {
      begun = true;
      listen(tell);
    } else {
      // The last state lacks all events since then, so a new one is fetched.
      fetch('state').then((r) => r.text()).then((t) => port.postMessage(['state', t]), () => state && port.postMessage(['state', state]));
    }
  };
}
