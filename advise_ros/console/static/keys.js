// The keyboard: everything that a mouse can do, and hold from anywhere.
const ARROW = { ArrowUp: 0, ArrowRight: 1, ArrowDown: 2, ArrowLeft: 3 };
const STEPS = [[0, 1], [1, 0], [0, -1], [-1, 0]];

export function keyAct(page, event) {
  const typing = event.target.closest?.('input:not([type=checkbox])');
  if (event.key === 'Escape') { page.help = false; if (typing) event.target.blur(); return; }
  if (event.ctrlKey || event.metaKey || event.altKey || (typing && event.key !== 'Enter')) return;
  if (act(page, event, typing)) event.preventDefault();
}

// Who clicks a button and goes on by keys means the answer by Enter, not the button again.
export function letGo(event) {
  if (event.pointerType && event.target.closest('button, [type=checkbox]')) document.activeElement.blur();
}

function act(page, event, typing) {
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (key === ' ') { if (!event.repeat) page.act('hold'); return true; }
  if (key === 'Enter') return enter(page, event, typing);
  if (event.repeat && !(key in ARROW)) return false;
  if (key in ARROW) return arrow(page, ARROW[key], event.shiftKey);
  if (key === 'Backspace') { page.undo(); return true; }
  if (key === '?') { page.help = !page.help; return true; }
  if (key === 'h') { page.show = { ...page.show, unsure: !page.show.unsure }; return true; }
  if (key === 'r') { page.replay(); return true; }
  if (/^[1-9]$/.test(key) && page.map && Number(key) <= page.map.layers) { page.layer = Number(key) - 1; return true; }
  if (!page.query) return false;
  if ((key === 'y' || key === 'n') && page.options.length) { page.choose(key === 'y' ? 0 : 1); return true; }
  if (key === 's') { if (page.drawing) page.splitItself(); else page.skip(); return true; }
  if (key === 'u') { page.unsure(); return true; }
  if (key === 'm') { page.mixed(); return true; }
  if (key === 'o') { page.avoidOthers(); return true; }
  if (key === 'x' && page.drawing) { page.mark(page.cursor); return true; }
  return false;
}

// Enter sends, but a button or link that has the focus is what Enter is for; the compass is no such button.
function enter(page, event, typing) {
  if (event.target.matches?.('[type=checkbox]')) { event.target.click(); return true; } // The space bar is taken.
  const focused = event.target.closest?.('button, a, summary');
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
