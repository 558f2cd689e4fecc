// The page's skeleton; texts come in by interpolation alone, so nothing that a person wrote is ever read as HTML.
export default `
<div class="console" :class="{dark}">
  <header>
    <button type="button" class="hold" @click="act('hold')" aria-label="Hold: stop the drone's policy flight now (space bar)"><span aria-hidden="true">⬣</span> HOLD <kbd>Space</kbd></button>
    <h1>advise</h1>
    <p class="status" role="status" aria-live="polite" data-test="status">{{ status }}</p>
    <span class="pill" :class="{good: canCommand, bad: cutOff}" data-test="connection">{{ line }}</span>
    <span class="pill" :class="troubled.length ? 'bad' : 'well'" v-if="(s.nodes || []).length">{{ troubled.length ? '✖ ' + count(troubled.length, 'node') + ' in trouble' : '● ' + count(s.nodes.length, 'node') + ' well' }}</span>
    <span class="pill" v-if="s.battery != null" data-test="battery">battery {{ s.battery }} %</span>
    <span class="pill" v-if="people > 1" data-test="people">{{ people }} windows</span>
    <label class="name">Your name <input v-model="by" maxlength="60" autocomplete="name" placeholder="kept with your answers"></label>
    <button type="button" class="quiet" @click="nextTheme()" :aria-label="'Colours: ' + theme">{{ {auto: '◐ auto', dark: '● dark', light: '○ light'}[theme] }}</button>
    <label class="language"><span class="unseen">{{ t('Language') }}</span> <select :value="language.code" @change="chooseLanguage($event.target.value)" data-test="language"><option v-for="(name, code) in language.names" :key="code" :value="code" :lang="code">{{ name }}</option></select></label>
    <button type="button" class="quiet" @click="help = !help" :aria-expanded="String(help)" aria-label="Keys and marks explained">? help</button>
  </header>
  <p class="alarm" v-if="alarm" role="alert" data-test="alarm">⚠ {{ alarm }}</p>
  <section class="card help" v-if="help" aria-label="Help">
    <p><b>Keys</b> — y, n: answer the question at once, where it offers that · arrows: this direction is right · Shift + arrow: wrong · o: all others are wrong · Enter: send · s: skip · u: unsure · m: these cells differ · Backspace: undo · Space: <b>hold the drone</b> · h: uncertainty · r: replay · 1–9: map · Esc: close</p>
    <p>If you name only what is right, its opposite counts as wrong; a dashed ✕ shows it before you send.</p>
  </section>
  <div class="columns">
    <div class="side">
    <section class="question card" aria-labelledby="question-title">
      <h2 id="question-title">{{ query ? 'Question ' + query.id : learner.enough ? '✓ I would fly it now' : 'No question' }}<small v-if="query && query.budget >= 0"> · {{ count(query.budget, 'answer') }} left</small></h2>
      <p class="ask" data-test="question">{{ asking[0] }} <b v-if="asking[1]">{{ asking[1] }}</b></p>
      <p class="enough" v-if="learner.enough && !query" data-test="enough">Fly the policy below, or go on with another flight: what is learnt stays open to answers and flights.</p>
      <template v-if="query">
        <p class="worth" v-if="options.length" data-test="worth">The answer is expected to save <b>{{ query.worth.toFixed(1) }} steps</b> of the route; what saves less than {{ learner.least }} is not asked.</p>
        <dl class="why" aria-label="Why it is asked" v-else>
          <div><dt>your flights disagree</dt><dd><meter min="0" max="1" :value="query.disagree" aria-label="your flights disagree"></meter> {{ percent(query.disagree) }}</dd></div>
          <div><dt>seldom flown there</dt><dd><meter min="0" max="1" :value="query.scarce" aria-label="seldom flown there"></meter> {{ percent(query.scarce) }}</dd></div>
          <div><dt>the drone is unsure</dt><dd><meter min="0" max="1" :value="query.unsure" aria-label="the drone is unsure"></meter> {{ percent(query.unsure) }}</dd></div>
        </dl>
        <p class="said" v-if="before.length" data-test="before">Said there before: <span v-for="entry in before" :key="entry.id">answer {{ entry.id }} by {{ entry.by || 'someone' }}, {{ said(entry) }} ({{ count(overlap(entry), 'cell') }}). </span></p>
        <button type="button" class="quiet" v-if="query.moments.length" @click="replay()" data-test="replay">{{ replaying >= 0 ? '■ stop: ' + query.moments[replaying].id + ' (' + (replaying + 1) + ' of ' + query.moments.length + ')' : '▶ Show how it was flown there (' + count(query.moments.length, 'moment') + ')' }}</button>
      </template>
    </section>

    <section class="answer card" aria-labelledby="answer-title">
      <h2 id="answer-title">Your answer</h2>
      <div class="options" v-if="options.length && !drawing" role="group" aria-label="Answer at once">
        <button v-for="(option, index) in options" :key="option.word" type="button" :class="['option', option.meaning ? 'through' : 'keep']" :disabled="!open || sending" :data-test="'option-' + index"
          @click="choose(index)" @mouseenter="consider(index)" @mouseleave="consider(-1)" @focus="consider(index)" @blur="consider(-1)">
          <b>{{ option.label.split(': ')[0] }}</b> <span>{{ option.label.split(': ')[1] }}</span> <small><i aria-hidden="true">{{ option.meaning ? '┅┅' : '━━' }}</i> then {{ count(option.route.length, 'step') }}</small> <kbd>{{ 'yn'[index] }}</kbd>
        </button>
      </div>
      <button type="button" class="quiet" v-if="options.length && !drawing" :aria-expanded="String(byDirections)" data-test="by-directions" @click="named = !named">{{ byDirections ? '▾' : '▸' }} Or name directions in {{ count(query.states.length, 'cell') }}</button>
      <compass v-if="!drawing && byDirections" :preferred="preferred" :avoided="avoided" :assumed="assumedWrong" :disabled="!open" @prefer="prefer" @avoid="avoid" @clear="clear"></compass>
      <div v-if="drawing" class="draw">
        <p>Draw over the cells that go another way than the rest, by finger or mouse; or move by the arrows and mark by x. They are then asked about apart.</p>
        <button type="button" @click="splitItself()">Split it for me (s)</button> <button type="button" @click="mixed()">Cancel (m)</button>
      </div>
      <p class="sentence" aria-live="polite" data-test="sentence" v-if="byDirections">{{ query ? sentence : 'Nothing to answer now.' }}</p>
      <p class="preview" aria-live="polite" v-if="preview || previewing" :class="{bad: worse}" data-test="preview"><b v-if="previewText()[0]">{{ previewText()[0] }}</b> {{ previewText()[1] }}</p>
      <div class="clash" v-if="clashing.length" role="alert" data-test="clash">
        <p><b>⚠ {{ clash && clash.soft ? 'Two answers contradict each other.' : 'This contradicts what was said before.' }}</b> <button type="button" class="quiet" v-if="clashElsewhere()" @click="showClash()">Show it on the map</button></p>
        <ul><li v-for="entry in clashing" :key="entry.id">Answer {{ entry.id }} by {{ entry.by || 'someone' }}: {{ said(entry) }}{{ overlap(entry) ? ', ' + count(overlap(entry), 'cell') + ' of this question' : '' }}
          <button type="button" @click="retract(entry.id)">Take back answer {{ entry.id }}</button></li></ul>
        <p v-if="clash && clash.soft"><button type="button" @click="retract(clash.mine)">Take back mine ({{ ours() ? said(ours()) : clash.mine }})</button> <button type="button" @click="clash = null">Keep both</button> The learner weighs them against each other.</p>
        <p v-else-if="!clash">Or send it: where the learner allows it, both are kept and weighed against each other.</p>
      </div>
      <div class="row">
        <button type="button" class="send" :disabled="!open || !isReady || sending" @click="send()" v-if="byDirections">Send <kbd>Enter</kbd></button>
        <button type="button" :disabled="!open" @click="avoidOthers()" v-if="!drawing && byDirections">Others wrong <kbd>o</kbd></button>
        <button type="button" :disabled="!canCommand" @click="undo()">Undo <kbd>⌫</kbd></button>
      </div>
      <div class="row">
        <button type="button" :disabled="!open || sending" @click="skip()">Skip <kbd>s</kbd></button>
        <button type="button" :disabled="!open || sending" @click="unsure()">Unsure <kbd>u</kbd></button>
        <button type="button" :disabled="!open" @click="mixed()" :aria-pressed="String(drawing)">These differ <kbd>m</kbd></button>
      </div>
      <label class="note-field">Comment <input class="comment" v-model="comment" maxlength="500" placeholder="optional, kept with the answer"></label>
      <p class="kept" v-if="kept.length" data-test="kept">{{ count(kept.length, 'answer') }} on the way{{ alarm ? ', kept until the connection is back' : '' }}.</p>
    </section>

    <section class="card past" aria-labelledby="past-title">
      <h2 id="past-title">Answers</h2>
      <p class="progress" data-test="progress">{{ count(learner.answers || 0, 'answer') }} given<template v-if="s.policy"> · expected success now <b>{{ percent(s.policy.success) }}</b><template v-if="!s.policy.reaches">; the route does not reach the end yet</template><template v-if="entersNow >= 0">; it enters <b>{{ count(entersNow, 'cell') }}</b> likely to be kept out of</template></template></p>
      <history :log="s.log" :gains="s.gains" :contradictions="learner.contradictions" :disabled="!canCommand" @retract="retract" @look="looked = $event"></history>
    </section>

    </div>
    <div class="main">
    <section class="maps" aria-label="Maps, one a waypoint">
      <div class="head"><h2>On the way to waypoint {{ layer + 1 }}<small v-if="query && layers[layer] && !byDirections"> · <i class="key disputed" aria-hidden="true">?</i> {{ count(layers[layer].disputed.size, 'cell') }} in dispute</small><small v-else-if="query && layers[layer]"> · <i class="key asked" aria-hidden="true">▢</i> {{ count(layers[layer].asked.size, 'cell') }} asked about</small></h2>
        <div class="layers-shown" role="group" aria-label="What the map shows">
          <label><input type="checkbox" v-model="show.flown"> <i class="key flown" aria-hidden="true">→</i> flown</label>
          <label><input type="checkbox" v-model="show.policy"> <i class="key policy" aria-hidden="true">▲</i> drone would fly</label>
          <label><input type="checkbox" v-model="show.route"> <i class="key route" aria-hidden="true">┄</i> route</label>
          <label v-if="s.site"><input type="checkbox" v-model="show.keepOut" data-test="keep-out"> <i class="key site" aria-hidden="true">■</i> keep out</label>
          <label><input type="checkbox" v-model="show.unsure" data-test="heat"> <i class="key heat" aria-hidden="true">■</i> unsure</label>
        </div>
      </div>
      <div class="stage">
      <grid-map v-if="map" ref="map" :map="map" :view="layers[layer]" :dark="dark" :label="mapLabel" :drawing="drawing" :cursor="drawing ? cursor : -1" @mark="mark"></grid-map>
      <p v-else class="none">The map comes with the first demonstration.</p>
      <div class="beside">
      <p class="legend"><span v-if="options.length"><i class="key disputed" aria-hidden="true">▢ ?</i> in dispute</span><span v-for="option in options" :key="option.word"><i :class="['key', option.meaning ? 'through' : 'keep']" aria-hidden="true">{{ option.meaning ? '┅┅' : '━━' }}</i> route after “{{ option.label.split(': ')[0] }}”</span><span v-if="s.site && show.keepOut && !show.unsure"><i class="key site" aria-hidden="true">■</i> the stronger, the likelier you want it kept out of</span><span v-if="byDirections"><i class="key asked" aria-hidden="true">▢</i> asked about</span><span><i class="key drone" aria-hidden="true">✣</i> drone and its track</span><span v-if="preview && preview.ok"><i class="key change" aria-hidden="true">▲</i> would change, <i class="key change" aria-hidden="true">━</i> route after</span><span v-if="clashing.length"><i class="key clash" aria-hidden="true">▦</i> contradicts an earlier answer</span><span v-if="replaying >= 0"><i class="key flown" aria-hidden="true">●</i> how it was flown</span><span v-if="drawing"><i class="key flown" aria-hidden="true">▨</i> goes another way</span><span v-if="show.unsure"><i class="key heat" aria-hidden="true">■</i> the stronger, the more unsure{{ s.policy && !s.policy.own ? " (by the usual weights, the learner's are not known)" : '' }}</span></p>
      <div class="thumbs" role="group" aria-label="Maps, the asked ones first" v-if="map && map.layers > 1">
        <button v-for="index in order" :key="index" type="button" :aria-pressed="String(index === layer)" @click="layer = index" :class="{asked: layers[index].asked.size}" :aria-label="'Waypoint ' + (index + 1) + ', ' + count(layers[index].asked.size, 'cell') + ' asked about'">
          <grid-map :map="map" :view="layers[index]" :dark="dark" small></grid-map><span>to {{ index + 1 }}{{ layers[index].clash.size ? ' ⚠' : layers[index].asked.size ? ' · asked' : '' }}</span>
        </button>
      </div>
      </div>
      </div>
    </section>

    <robot :nodes="s.nodes" :vehicle="s.vehicle" :flight="s.flight" :battery="s.battery" :disabled="!canCommand" @act="act($event)"></robot>
    </div>
  </div>
  <p class="toast" role="status" aria-live="assertive" :class="{bad: note && note.bad, shown: note}" data-test="note">{{ note ? note.text : '' }}</p>
</div>`;
