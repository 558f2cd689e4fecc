// NiceGUI loads this file; the page itself is made of modules that the server gives under /console.
import Console from '/console/app.js';
export default Console;
