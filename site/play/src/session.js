// @ts-check
// The model of this tab.
import { pool } from './begin.js';
import { Model } from './model.js';
import { Photos } from './photos.js';
import { meshShape } from './shapes.js';
import { Views } from './views.js';

export const model = new Model(pool);
export const photos = new Photos(model);
export const views = new Views(model, meshShape);
