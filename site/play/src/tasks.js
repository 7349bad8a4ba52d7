// @ts-check
// Requests that wait for the renderer.
import { Failure } from './pool.js';

/** @typedef {{ run: (hand: import('./pool.js').Hand) => import('./pool.js').Request, resolve: (ok: any) => void, reject: (error: Error) => void, dead?: boolean, isLater?: boolean, generation?: number }} Task */

export const cancelled = (message = 'cancelled') => new Failure({ code: 'cancelled', message });

export class Tasks {
  constructor() {
    /** @type {Task[]} */
    this.tasks = [];
    /** @type {Task | undefined} the task that runs */
    this.now = undefined;
  }

  // Runs the next task or makes the next picture, and ends the one that runs: see work.js.
  async work() {}
  abandon() {}

  // Runs a request as soon as the renderer is free, and again if the renderer is replaced. With `isLater`, the pictures of the page come
  // first. With a generation, other values or another text cancel it.
  /** @param {Task['run']} run @param {Pick<Task, 'isLater' | 'generation'>} [how] @returns {Promise<any> & { cancel: () => void }} */
  task(run, how = {}) {
    /** @type {any} */
    let entry;
    const done = new Promise((resolve, reject) => { entry = { ...how, run, resolve, reject }; });
    this.tasks.push(entry);
    this.work();
    return Object.assign(done, { cancel: () => { entry.dead = true; entry.reject(cancelled()); if (this.now === entry) this.abandon(); } });
  }

  // Cancels the tasks that `is` names. One that runs ends by itself.
  /** @param {(task: Task) => boolean} is @param {string} [message] */
  drop(is, message) {
    for (const task of this.tasks.filter(is)) {
      task.dead = true;
      task.reject(cancelled(message));
    }
    this.tasks = this.tasks.filter((task) => !task.dead);
  }
}
