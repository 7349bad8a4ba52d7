// The news of the server. As a shared worker it holds one connection for all tabs: browsers allow six to a server.
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
      // What has happened since the last state is not in it.
      fetch('state').then((r) => r.text()).then((t) => port.postMessage(['state', t]), () => state && port.postMessage(['state', state]));
    }
  };
}
