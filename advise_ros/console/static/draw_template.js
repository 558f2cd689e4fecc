// The skeleton of the page that draws a grid.
export default `
<div class="console drawing" :class="{dark}" :lang="language.code">
  <header>
    <h1>{{ t('Draw a grid') }}</h1>
    <p class="verdict" :class="{good: verdict?.ok, bad: verdict && !verdict.ok}" role="status" aria-live="polite" data-test="verdict"><span aria-hidden="true">{{ !verdict ? '…' : verdict.ok ? '✓' : '✖' }}</span> {{ sentence }}</p>
    <span class="pill" :class="{bad: !up, live: up}" data-test="connection">{{ up ? '● ' + t('live') : '○ ' + t('cut off') }}</span>
    <label class="language"><span class="unseen">{{ t('Language') }}</span> <select :value="language.code" @change="chooseLanguage($event.target.value)" data-test="language"><option v-for="(name, code) in language.names" :key="code" :value="code" :lang="code">{{ name }}</option></select></label>
    <button type="button" class="quiet" @click="nextTheme()" :aria-label="t('Colours: {theme}', { theme: themeName })"><span aria-hidden="true">{{ {auto: '◐', dark: '●', light: '○'}[theme] }}</span></button>
    <button type="button" class="quiet" @click="help = !help" :aria-expanded="String(help)" :aria-label="t('Keys')"><span aria-hidden="true">?</span></button>
  </header>
  <section class="card help" v-if="help" :aria-label="t('Keys')"><dl><div v-for="[key, text] in keys" :key="key"><dt><kbd>{{ key }}</kbd></dt><dd>{{ t(text) }}</dd></div></dl></section>
  <div class="sheet">
    <section class="board-side" :aria-label="t('Map')">
      <div class="tools">
        <div class="chips kinds" role="group" :aria-label="t('Tools')"><button v-for="(one, index) in tools" :key="one.name" type="button" :aria-pressed="String(tool === one.name)" :data-test="'tool-' + one.name" @click="pick(one.name)"><span class="sign" aria-hidden="true">{{ one.sign }}</span> <span>{{ t(one.label) }}</span> <kbd>{{ index + 1 }}</kbd></button></div>
        <div class="chips" role="group" :aria-label="t('Changes')"><button type="button" :disabled="!past.length" @click="undo()" :aria-label="t('Undo')" data-test="undo">↶</button><button type="button" :disabled="!future.length" @click="redo()" :aria-label="t('Redo')" data-test="redo">↷</button></div>
        <div class="chips" role="group" :aria-label="t('Size of the map')"><button type="button" @click="zoom(1.4)" :aria-label="t('Larger')">+</button><button type="button" @click="zoom(0.7)" :aria-label="t('Smaller')">−</button><button type="button" @click="whole()" :aria-label="t('Whole map')" data-test="whole">⤢</button></div>
        <button type="button" class="send small" @click="save()" :disabled="!up">{{ t('Save') }}</button>
      </div>
      <p class="hint" id="draw-hint" data-test="hint">{{ hint }} <button type="button" class="quiet" v-if="fence.length > 2" @click="closeFence()" data-test="close-fence">{{ t('Close the fence') }}</button></p>
      <div class="board" ref="board" tabindex="0" role="application" :aria-label="boardLabel" aria-describedby="draw-hint" data-test="board" @focus="focused = true" @blur="focused = false">
        <canvas ref="canvas" :class="tool" @pointerdown="onDown" @pointermove="onMove" @pointerup="onUp" @pointercancel="onCancel" @wheel.prevent="onWheel" @contextmenu.prevent></canvas>
      </div>
      <p class="unseen" aria-live="polite" data-test="cursor">{{ cursorText }}</p>
    </section>
    <div class="beside-board">
      <section class="card" aria-labelledby="save-title">
        <h2 id="save-title">{{ t('Save') }}</h2>
        <label class="field wide">{{ t('File') }} <input v-model="name" maxlength="120" spellcheck="false" data-test="name" @keydown.enter="save()"></label>
        <p class="soft">{{ t('in {folder}', { folder: start.folder }) }}</p>
        <div class="row"><button type="button" class="send" @click="save()" :disabled="!up" data-test="save">{{ t('Save the grid file') }}</button></div>
        <div ref="outcome">
        <div class="clash" v-if="exists" role="alert" data-test="exists"><p>{{ exists.message }}.</p><div class="row"><button type="button" @click="save(exists.other)" data-test="save-other">{{ t('Save as {name}', { name: exists.other }) }}</button><button type="button" @click="save(name, true)" data-test="replace">{{ t('Replace it') }}</button></div></div>
        <div class="saved" v-if="saved" role="status" data-test="saved"><p><b>✓ {{ t('Saved: {path}', { path: saved.path }) }}</b></p><p v-if="saved.lost">{{ t('Comments of the file that was opened are not in it.') }}</p><p>{{ t('Next:') }} <code>{{ saved.next }}</code></p></div>
        </div>
      </section>
      <section class="card" aria-labelledby="route-title">
        <h2 id="route-title">{{ t('Waypoints') }} <small v-if="verdict?.ok">· {{ tn('{n} step round, {metres} m', '{n} steps round, {metres} m', verdict.steps, { metres: number(verdict.metres) }) }}</small></h2>
        <p class="soft" v-if="!grid.waypoints.length">{{ t('None yet. They are flown in this order; the last one is where a flight ends and begins.') }}</p>
        <ol class="waypoints"><li v-for="(cell, index) in grid.waypoints" :key="index" :class="{held: held === index, off: !isInside(cell)}">
          <button type="button" class="quiet name" :aria-pressed="String(held === index)" @click="hold(index)">{{ index + 1 }}<span class="unseen">: </span> [{{ cell.join(', ') }}]</button>
          <button type="button" class="quiet" :disabled="!index" @click="reorder(index, -1)" :aria-label="t('Waypoint {n} earlier', { n: index + 1 })">↑</button>
          <button type="button" class="quiet" :disabled="index === grid.waypoints.length - 1" @click="reorder(index, 1)" :aria-label="t('Waypoint {n} later', { n: index + 1 })">↓</button>
          <button type="button" class="quiet" @click="remove(index)" :aria-label="t('Remove waypoint {n}', { n: index + 1 })">✕</button>
        </li></ol>
        <div class="row" v-if="held >= 0"><button type="button" @click="add(grid.waypoints[held])" data-test="again">{{ t('Fly to waypoint {n} once more', { n: held + 1 }) }}</button></div>
      </section>
      <section class="card" aria-labelledby="cells-title">
        <h2 id="cells-title">{{ t('Cells') }} <small>· {{ tn('{n} blocked', '{n} blocked', grid.blocked.size) }}</small></h2>
        <div class="fields">
          <label class="field" v-for="one in numbers" :key="one.key">{{ t(one.label) }} <input inputmode="decimal" :value="shown(one)" @input="drafts[one.key] = $event.target.value" @change="edit(one, $event.target.value)" :aria-invalid="String(one.key in wrong)" :data-test="'field-' + one.key"></label>
        </div>
        <p class="soft">{{ t('The area is {x} x {y} m. The fence of guard and bridge (dashed) stands {margin} m outside, as their parameter fence_margin_m says.', { x: metres(grid.width), y: metres(grid.height), margin: 1 }) }}</p>
        <div class="row" v-if="start.walls"><button type="button" @click="readWalls()" data-test="walls">{{ t('Block the walls of the map') }}</button></div>
        <div class="row" v-if="grid.blocked.size"><button type="button" @click="freeAll()">{{ t('Free all cells') }}</button></div>
      </section>
      <section class="card" aria-labelledby="earth-title">
        <h2 id="earth-title">{{ t('On the earth') }}</h2>
        <p class="soft">{{ t('Where the metres count from (x 0, y 0), and where the y axis points. Needed only for missions and maps of other tools.') }}</p>
        <div class="fields">
          <label class="field" v-for="one in placing" :key="one.key">{{ t(one.label) }} <input inputmode="decimal" :value="shown(one)" @input="drafts[one.key] = $event.target.value" @change="edit(one, $event.target.value)" :aria-invalid="String(one.key in wrong)" :data-test="'field-' + one.key"></label>
        </div>
        <div class="row" v-if="grid.earth || grid.heading !== null"><button type="button" @click="noPlace()">{{ t('No place on the earth') }}</button></div>
      </section>
      <section class="card" aria-labelledby="picture-title">
        <h2 id="picture-title">{{ t('Picture') }}</h2>
        <p class="bad" v-if="hidden" data-test="hidden">⚠ {{ hidden }}</p>
        <label class="field wide">{{ t('Orthophoto or floor plan') }} <input type="file" accept="image/*" @change="load" data-test="picture"></label>
        <template v-if="picture">
          <label class="field wide">{{ t('Strength') }} <input type="range" min="0.1" max="1" step="0.05" v-model.number="strength"></label>
          <template v-if="!start.walls">
          <label class="field wide">{{ t('Lower left and upper right corner') }} <input v-model="cornersText" spellcheck="false" :placeholder="onEarth ? '47.3975,8.5450 47.3979,8.5458' : '0,0 60,40'" data-test="corners" @keydown.enter="place()"></label>
          <div class="row"><label class="tick"><input type="checkbox" v-model="onEarth" data-test="on-earth"> {{ t('latitude, longitude') }}</label> <button type="button" @click="place()" data-test="place">{{ t('Place the picture') }}</button></div>
          <p class="soft">{{ t('Or all four corners, from the upper left one clockwise.') }}</p>
          </template>
        </template>
      </section>
    </div>
  </div>
  <p class="toast" role="status" aria-live="polite" :class="{bad: note && note.bad, shown: note}" data-test="note">{{ note ? note.text : '' }}</p>
</div>`;
