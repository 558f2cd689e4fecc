// What the page that draws a grid offers: tools, keys, and the numbers of a grid file.
import { recelled, rearranged } from '/console/draw_grid.js';
import { mark } from '/console/language.js';

export const TOOLS = [
  { name: 'area', sign: '⬚', label: mark('Area'), hint: mark('Drag from corner to corner. Pull a dot to enlarge or to cut off; the middle one moves everything.') },
  { name: 'waypoint', sign: '①', label: mark('Waypoints'), hint: mark('Touch cells in the order of flight; the last is the final position. Drag a waypoint to move it.') },
  { name: 'wall', sign: '▦', label: mark('Walls'), hint: mark('Draw over cells that may not be entered; begin on a blocked one to free cells.') },
  { name: 'box', sign: '◼', label: mark('Box'), hint: mark('Drag from corner to corner; all cells of the box are blocked, or freed if it begins on a blocked one.') },
  { name: 'fence', sign: '⬠', label: mark('Fence'), hint: mark('Touch the corner cells of the fence, then the first one again: all cells beyond it are blocked.') },
  { name: 'hand', sign: '✥', label: mark('Move'), hint: mark('Drag the map. With any tool two fingers or the wheel move and zoom it.') },
];
export const KEYS = [
  ['1–6', mark('tools')], ['↑ → ↓ ←', mark('move the cursor')], ['⇧ ↑ → ↓ ←', mark('take the waypoint under the cursor along')], ['Enter', mark('use the tool in this cell')],
  ['w', mark('a waypoint here, the next in order')], ['⇧ ☝', mark('fly to a waypoint once more')], ['b', mark('block this cell, or free it')], ['Del', mark('remove the waypoint, or free the cell')],
  ['<, >', mark('the waypoint here earlier, later')], ['Ctrl Z, Ctrl Y', mark('undo, redo')], ['Ctrl S', mark('save')],
  ['+, −, 0', mark('larger, smaller, the whole map')], ['Ctrl ↑ → ↓ ←', mark('move the map')], ['?', mark('these keys')], ['Esc', mark('give up what was begun')],
];
export const NUMBERS = [
  { key: 'resolution', field: 'resolution', label: mark('Cell size [m]'), set: (grid, value) => recelled(grid, value), size: true },
  { key: 'altitude', field: 'altitude', label: mark('Altitude [m]'), set: (grid, value) => ({ ...grid, altitude: value }) },
  { key: 'width', field: 'width', label: mark('Columns'), set: (grid, value) => rearranged(grid, { width: value }), size: true, whole: true },
  { key: 'height', field: 'height', label: mark('Rows'), set: (grid, value) => rearranged(grid, { height: value }), size: true, whole: true },
  { key: 'origin-0', field: 'origin', at: 0, label: mark('Left edge x [m]'), set: (grid, value) => ({ ...grid, origin: [value, grid.origin[1]] }) },
  { key: 'origin-1', field: 'origin', at: 1, label: mark('Lower edge y [m]'), set: (grid, value) => ({ ...grid, origin: [grid.origin[0], value] }) },
];
export const HEADING = 'heading';
export const PLACING = [
  { key: 'latitude', at: 0, label: mark('Latitude [°]') }, { key: 'longitude', at: 1, label: mark('Longitude [°]') }, { key: HEADING, label: mark('Heading of the y axis [°]') },
];
