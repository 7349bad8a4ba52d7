// News of the server. A shared worker holds one connection for all tabs, because browsers allow only six per server.
const KINDS = ['state', 'shown', 'errors', 'warnings', 'busy', 'progress', 'done', 'look', 'export'];

export function listen(tell) {
  let source;
  const open = () => {
    source = new EventSource('events');
    for (const kind of KINDS) source.addEventListener(kind, (e) => tell(kind, e.data));
    source.onerror = () => {
      tell('offline', 'null');
      if (source.readyState === EventSource.CLOSED) setTimeout(open, 1500);
    };
  };
  open();
}

if (typeof SharedWorkerGlobalScope !== 'undefined' && self instanceof SharedWorkerGlobalScope) {
  const ports = new Set();
  let state = null;
  let begun = false;
  const tell = (kind, data) => {
    if (kind === 'state') state = data;
    for (const port of ports) port.postMessage([kind, data]);
  };
  self.onconnect = (e) => {
    const [port] = e.ports;
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
