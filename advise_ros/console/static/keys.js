// The keyboard: everything that a mouse can do, and hold from anywhere. Each key does one thing; the help shows this list.
import { mark } from '/console/language.js';

const ARROW = { ArrowUp: 0, ArrowRight: 1, ArrowDown: 2, ArrowLeft: 3 };
const STEPS = [[0, 1], [1, 0], [0, -1], [-1, 0]];

export const KEYS = [
  ['Space', mark('hold the drone, whatever else is open')],
  ['y, n', mark('first or second answer, at once')],
  ['↑ → ↓ ←', mark('this direction is right (while you mark cells: move)')],
  ['⇧ ↑ → ↓ ←', mark('this direction is wrong')],
  ['o', mark('all other directions are wrong')],
  ['Enter', mark('send the directions or the marked cells')],
  ['⌫', mark('clear what you picked')],
  ['s', mark('skip this question')],
  ['u', mark('I am unsure')],
  ['m', mark('these cells differ: mark those that go another way')],
  ['x', mark('mark the cell under the cursor')],
  ['a', mark('let the drone split the cells')],
  ['t', mark('take the last answer back')],
  ['1–9', mark('the map to this waypoint')],
  ['+, −, 0', mark('larger, smaller, the whole map')],
  ['Ctrl ↑ → ↓ ←', mark('move the map')],
  ['v', mark('where the drone is unsure')],
  ['r', mark('how it was flown there')],
  ['?', mark('these keys')],
  ['Esc', mark('close')],
];

export function keyAct(page, event) {
  const typing = event.target.closest?.('input:not([type=checkbox]), select');
  if (event.key === 'Escape') { page.help = false; if (typing) event.target.blur(); return; }
  if (event.ctrlKey && event.key in ARROW && !typing) { pan(page, ARROW[event.key]); event.preventDefault(); return; }
  if (event.ctrlKey || event.metaKey || event.altKey || (typing && event.key !== 'Enter')) return;
  if (act(page, event, typing)) event.preventDefault();
}

// Who clicks a button and goes on by keys means the answer by Enter, not the button again.
export function letGo(event) {
  if (event.pointerType && event.target.closest('button, [type=checkbox]')) document.activeElement.blur();
}

function pan(page, action) { page.$refs.map?.pan(-80 * STEPS[action][0], 80 * STEPS[action][1]); }

function act(page, event, typing) {
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (key === ' ') { if (!event.repeat) page.act('hold'); return true; }
  if (key === 'Enter') return enter(page, event, typing);
  if (key === '+' || key === '-') { page.$refs.map?.zoom(key === '+' ? 1.25 : 0.8); return true; }
  if (event.repeat && !(key in ARROW)) return false;
  if (key in ARROW) return arrow(page, ARROW[key], event.shiftKey);
  if (/^[1-9]$/.test(key) && page.map && Number(key) <= page.map.layers) { page.layer = Number(key) - 1; return true; }
  const always = {
    Backspace: () => page.clearPicks(), t: () => page.act('undo'), '?': () => { page.help = !page.help; }, 0: () => page.$refs.map?.whole(),
    v: () => { page.show = { ...page.show, unsure: !page.show.unsure }; }, r: () => page.replay(),
  };
  const asked = {
    y: () => page.choose(0), n: () => page.choose(1), s: () => page.skip(), u: () => page.unsure(), m: () => page.mixed(), o: () => page.avoidOthers(),
    x: () => page.drawing && page.mark(page.cursor), a: () => page.drawing && page.splitItself(),
  };
  const does = always[key] || (page.query && asked[key]);
  if (does) does();
  return Boolean(does);
}

// Enter sends, but a button or link that has the focus is what Enter is for; the compass is no such button.
function enter(page, event, typing) {
  if (event.target.matches?.('[type=checkbox]')) { event.target.click(); return true; } // The space bar is taken.
  const focused = event.target.closest?.('button, a, summary, select');
  if (focused && !focused.closest('.compass') && !focused.matches('.send')) return false;
  if (typing && !event.target.matches('.comment')) return false;
  page.send();
  return true;
}

function arrow(page, action, shift) {
  if (!page.query) return false;
  if (page.drawing) {
    const { width, height } = page.map, at = page.cursor, [dx, dy] = STEPS[action];
    const x = (at % width) + dx, y = Math.floor(at / width) + dy;
    if (x >= 0 && x < width && y >= 0 && y < height) page.cursor = y * width + x;
    return true;
  }
  if (shift) page.avoid(action); else page.prefer(action);
  return true;
}
