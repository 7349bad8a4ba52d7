// @ts-check
// The model of this tab.
import { pool } from './begin.js';
import { Model } from './model.js';

export const model = new Model(pool);
