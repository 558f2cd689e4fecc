// One view a waypoint layer, as the painter takes it, out of the sections of the page.
import { percent, t, tn } from '/console/language.js';
import { place } from '/console/words.js';

function perLayer(map, states, put) {
  const size = map.width * map.height;
  states.forEach((state, index) => put(Math.floor(state / size), state % size, index));
}

// The cells of a route in one layer, with the cell where it leaves it.
function routeIn(route, layer, size) {
  const cells = [];
  route.forEach((state, index) => {
    if (Math.floor(state / size) === layer) cells.push(state % size);
    else if (index && Math.floor(route[index - 1] / size) === layer) cells.push(state % size);
  });
  return cells;
}

let flownOf = null, flownLayers = [];
function flownPerLayer(map, flown) {
  if (flownOf === flown) return flownLayers;
  flownLayers = Array.from({ length: map.layers }, () => new Map());
  perLayer(map, flown.states, (layer, cell, index) => flownLayers[layer].set(cell, flown.taken.slice(4 * index, 4 * index + 4)));
  flownOf = flown;
  return flownLayers;
}

export function layerViews(page) {
  const { map, s, query, show, preview } = page, size = map.width * map.height;
  const sets = () => Array.from({ length: map.layers }, () => new Set());
  const asked = sets(), part = sets(), clash = sets(), changes = Array.from({ length: map.layers }, () => new Map());
  if (query) perLayer(map, query.states, (layer, cell) => asked[layer].add(cell));
  perLayer(map, [...page.part], (layer, cell) => part[layer].add(cell));
  perLayer(map, page.clashCells, (layer, cell) => clash[layer].add(cell));
  if (page.looked) perLayer(map, page.looked.states, (layer, cell) => part[layer].add(cell));
  if (preview?.ok) perLayer(map, preview.changed, (layer, cell, index) => changes[layer].set(cell, preview.actions[index]));
  const flown = s.flown && flownPerLayer(map, s.flown), policy = s.policy?.greedy.length === size * map.layers ? s.policy : null;
  const keepOut = (preview?.ok && preview.keepOut.length ? preview.keepOut : s.site?.keepOut) || null;
  return Array.from({ length: map.layers }, (_, layer) => ({
    layer, asked: asked[layer], part: part[layer], clash: clash[layer], changes: changes[layer], show: { ...show }, next: layer,
    final: layer === map.layers - 1 ? map.waypoints[layer] : -1, flown: flown && flown[layer],
    disputed: new Set(asked[layer].size ? query.disputed : []), lit: page.byDirections, keepOut: show.keepOut ? keepOut : null,
    greedy: policy && policy.greedy.slice(layer * size, (layer + 1) * size),
    unsure: policy && policy.unsure.slice(layer * size, (layer + 1) * size),
    routes: show.route ? routes(page, layer, size) : [],
  }));
}

function routes(page, layer, size) {
  const { s, preview } = page;
  if (preview?.ok && page.considered < 0) {
    return [
      { cells: routeIn(preview.before, layer, size), dashed: true, colour: 'route' },
      { cells: routeIn(preview.after, layer, size), colour: 'change', width: 0.09, stuck: !preview.reaches[1] && endsIn(preview.after, layer, size) },
    ];
  }
  if (page.options.length && page.query.states.some((state) => Math.floor(state / size) === layer)) return page.options.map((option) => after(page, option, layer, size));
  if (!s.policy) return [];
  return [{ cells: routeIn(s.policy.route, layer, size), dashed: true, colour: 'route', stuck: !s.policy.reaches && endsIn(s.policy.route, layer, size) }];
}

// The route that is expected after an answer of one gesture; the two run beside each other.
function after(page, option, layer, size) {
  const { map } = page, cells = routeIn(option.route, layer, size), keeps = option.meaning === 0;
  if (layer === map.layers - 1 && cells.length) cells.push(map.waypoints[layer]);
  const chosen = page.considered >= 0 && page.options[page.considered] === option;
  return { cells, dashed: !keeps, colour: keeps ? 'keep' : 'through', width: chosen ? 0.12 : 0.08, shift: keeps ? -0.08 : 0.08 };
}

const endsIn = (route, layer, size) => route.length > 0 && Math.floor(route[route.length - 1] / size) === layer;

// The map in words, for those who do not see it.
export function describe(page, layer) {
  const { map } = page, view = page.layers[layer], cells = [...view.asked];
  const parts = [cells.length ? tn('{n} cell asked about, {place}', '{n} cells asked about, {place}', cells.length, { place: place(cells, map.width) }) : t('nothing asked here')];
  if (view.disputed.size) parts.push(tn('{n} cell in dispute', '{n} cells in dispute', view.disputed.size));
  if (page.preview?.ok) parts.push(tn('{n} cell would change', '{n} cells would change', view.changes.size));
  if (page.s.policy) parts.push(t('expected success {share}', { share: percent(page.s.policy.success) }));
  return t('Map to waypoint {n}, {width} by {height} cells, north up: {what}', { n: layer + 1, width: map.width, height: map.height, what: parts.join('; ') });
}
