// NiceGUI loads this file; the page itself is made of modules that the server gives under /console.
import Draw from '/console/draw_app.js';
export default Draw;
