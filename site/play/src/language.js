// @ts-check
// Messages to the language server in the editor's worker, with the files of the graph.

// Files come with the next message after they have changed. This one says nothing else.
const CHANGED = { jsonrpc: '2.0', method: 'workspace/didChangeWatchedFiles', params: { changes: [] } };

export class Language {
  /** @param {Pick<import('./pool.js').Hand, 'ask'>} hand @param {() => Record<string, string>} files */
  constructor(hand, files) {
    this.hand = hand;
    this.files = files;
    /** @type {Record<string, string> | null} the files that the server has */
    this.told = null;
  }

  /** @param {any} message @returns {Promise<any[]>} */
  async send(message) {
    const files = this.files();
    const isNew = files !== this.told;
    this.told = files;
    try {
      return (await this.hand.ask({ op: 'lsp', message, files: isNew ? files : undefined }).done).messages;
    } catch (error) {
      if (isNew && this.told === files) this.told = null;
      throw error;
    }
  }

  // Tells files that have changed without a change of the text: the server checks its texts again.
  follow() {
    if (this.told && this.told !== this.files()) this.send(CHANGED).catch(() => {});
  }

  // The engine was started again: it has no files.
  restarted() { this.told = null; }
}
