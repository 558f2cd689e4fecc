// The page's skeleton; texts come in by interpolation alone, so nothing that a person wrote is ever read as HTML.
export default `
<div class="console" :class="{dark, alarmed: alarm}" :lang="language.code">
  <header>
    <button type="button" class="hold" @click="act('hold')" :aria-label="t('Hold: stop the drone’s policy flight now (space bar)')"><span aria-hidden="true">⬣</span> {{ t('HOLD') }} <kbd>{{ t('Space') }}</kbd></button>
    <h1>advise</h1>
    <p class="status" role="status" aria-live="polite" data-test="status">{{ status }}</p>
    <span class="pill" :class="{good: canCommand, bad: cutOff}" data-test="connection">{{ line }}</span>
    <span class="pill" :class="troubled.length ? 'bad' : 'well'" v-if="(s.nodes || []).length">{{ troubled.length ? '✖ ' + tn('{n} node in trouble', '{n} nodes in trouble', troubled.length) : '● ' + tn('{n} node well', '{n} nodes well', s.nodes.length) }}</span>
    <span class="pill battery" v-if="s.battery != null" data-test="battery">{{ t('battery {share}', { share: percent(s.battery / 100) }) }}</span>
    <span class="pill people" v-if="people > 1" data-test="people">{{ tn('{n} window', '{n} windows', people) }}</span>
    <label class="language"><span class="unseen">{{ t('Language') }}</span> <select :value="language.code" @change="chooseLanguage($event.target.value)" data-test="language"><option v-for="(name, code) in language.names" :key="code" :value="code" :lang="code">{{ name }}</option></select></label>
    <button type="button" class="quiet" @click="nextTheme()" :aria-label="t('Colours: {theme}', { theme: themeName })"><span aria-hidden="true">{{ {auto: '◐', dark: '●', light: '○'}[theme] }}</span><span class="wide"> {{ themeName }}</span></button>
    <button type="button" class="quiet" @click="help = !help" :aria-expanded="String(help)" :aria-label="t('Keys')"><span aria-hidden="true">?</span><span class="wide"> {{ t('Keys') }}</span></button>
  </header>
  <p class="alarm" v-if="alarm" role="alert" data-test="alarm">⚠ {{ alarm }}</p>
  <section class="card help" v-if="help" :aria-label="t('Keys')">
    <dl><div v-for="[key, text] in keys" :key="key"><dt><kbd>{{ key === 'Space' ? t('Space') : key }}</kbd></dt><dd>{{ t(text) }}</dd></div></dl>
    <p>{{ t('If you name only what is right, its opposite counts as wrong; a dashed ✕ shows it before you send.') }}</p>
  </section>
  <div class="columns">
    <div class="work">
    <section class="question card" aria-labelledby="question-title">
      <h2 id="question-title">{{ query ? t('Question {id}', { id: query.id }) : learner.enough ? '✓ ' + t('I know enough') : t('No question') }}<small v-if="query && query.budget >= 0"> · {{ tn('{n} answer left', '{n} answers left', query.budget) }}</small></h2>
      <p class="ask" data-test="question"><b>{{ asking.short }}</b></p>
      <p class="enough" v-if="!query && learner.enough" data-test="enough">{{ t('Next: take off and fly the policy. More flights and answers are welcome at any time.') }}</p>
      <div class="row" v-if="!query && learner.enough"><button type="button" :disabled="!canCommand" @click="act('takeoff')">{{ t('Take off') }}</button><button type="button" class="send" :disabled="!canCommand" @click="act('fly')">{{ t('Fly the policy') }}</button></div>
      <details v-if="query" class="reasons" :open="reasons" @toggle="reasons = $event.target.open"><summary data-test="why">{{ t('Why?') }}</summary>
        <p v-for="line in asking.why" :key="line" data-test="reason">{{ line }}</p>
        <p class="worth" v-if="options.length" data-test="worth">{{ t('The answer is expected to save {steps} of the route; what saves less than {least} is not asked.', { steps: stepsSaved, least: number(learner.least || 0, 1) }) }}</p>
        <p class="said" v-if="before.length" data-test="before">{{ t('Said there before:') }} <span v-for="entry in before" :key="entry.id">{{ t('answer {id} by {name}, {said} ({cells})', { id: entry.id, name: entry.by || t('someone'), said: said(entry), cells: cellsOf(overlap(entry)) }) }}. </span></p>
        <button type="button" class="quiet" v-if="query.moments.length" @click="replay()" data-test="replay">{{ replaying >= 0 ? '■ ' + t('stop: {id} ({at} of {all})', { id: query.moments[replaying].id, at: replaying + 1, all: query.moments.length }) : '▶ ' + tn('Show how it was flown there ({n} moment)', 'Show how it was flown there ({n} moments)', query.moments.length) }}</button>
      </details>
    </section>

    <section class="maps" :aria-label="t('Map')">
      <div class="head"><h2>{{ t('To waypoint {n}', { n: layer + 1 }) }}<small v-if="query && layers[layer] && !byDirections"> · <i class="key disputed" aria-hidden="true">?</i> {{ tn('{n} cell in dispute', '{n} cells in dispute', layers[layer].disputed.size) }}</small><small v-else-if="query && layers[layer]"> · <i class="key asked" aria-hidden="true">▢</i> {{ tn('{n} cell asked about', '{n} cells asked about', layers[layer].asked.size) }}</small></h2>
        <div class="chips" role="group" :aria-label="t('Which map')" v-if="map && map.layers > 1">
          <button v-for="index in map.layers" :key="index" type="button" :aria-pressed="String(index - 1 === layer)" :class="{asked: layers[index - 1].asked.size}" :aria-label="t('Map to waypoint {n}, {cells} asked about', { n: index, cells: cellsOf(layers[index - 1].asked.size) })" @click="layer = index - 1">{{ index }}{{ layers[index - 1].clash.size ? ' ⚠' : layers[index - 1].asked.size ? ' ?' : '' }}</button>
        </div>
        <div class="zoom" role="group" :aria-label="t('Size of the map')" v-if="map">
          <button type="button" @click="$refs.map.zoom(1.4)" :aria-label="t('Larger')" data-test="larger">+</button>
          <button type="button" @click="$refs.map.zoom(0.7)" :aria-label="t('Smaller')" data-test="smaller">−</button>
          <button type="button" @click="$refs.map.whole()" :aria-label="t('Whole map')" data-test="whole">⤢</button>
          <button type="button" @click="$refs.map.follow(true)" v-if="query" :aria-label="t('To the question')" data-test="to-question">◎</button>
        </div>
        <button type="button" class="quiet" :aria-expanded="String(marks)" @click="marks = !marks" data-test="marks">{{ marks ? '▾' : '▸' }} {{ t('Marks') }}</button>
      </div>
      <div class="stage">
      <grid-map v-if="map" ref="map" :map="map" :view="layers[layer]" :dark="dark" :label="mapLabel" :drawing="drawing" :cursor="drawing ? cursor : -1" @mark="mark"></grid-map>
      <p v-else class="none">{{ t('The map comes with the first demonstration.') }}</p>
      <div class="beside" v-if="marks">
        <div class="layers-shown" role="group" :aria-label="t('What the map shows')">
          <label><input type="checkbox" v-model="show.flown"> <i class="key flown" aria-hidden="true">→</i> {{ t('flown') }}</label>
          <label><input type="checkbox" v-model="show.policy"> <i class="key policy" aria-hidden="true">▲</i> {{ t('drone would fly') }}</label>
          <label><input type="checkbox" v-model="show.route"> <i class="key route" aria-hidden="true">┄</i> {{ t('route') }}</label>
          <label v-if="s.site"><input type="checkbox" v-model="show.keepOut" data-test="keep-out"> <i class="key site" aria-hidden="true">■</i> {{ t('keep out, in per cent') }}</label>
          <label><input type="checkbox" v-model="show.unsure" data-test="heat"> <i class="key heat" aria-hidden="true">■</i> {{ t('unsure') }}</label>
        </div>
        <ul class="legend">
          <li v-if="options.length"><i class="key disputed" aria-hidden="true">▢ ?</i> {{ t('in dispute') }}</li>
          <li v-for="(option, index) in options" :key="option.word"><i :class="['key', option.meaning ? 'through' : 'keep']" aria-hidden="true">{{ option.meaning ? '┅┅' : '━━' }}</i> {{ t('route after “{answer}”', { answer: asking.options[index][0] }) }}</li>
          <li v-if="byDirections && query"><i class="key asked" aria-hidden="true">▢</i> {{ t('asked about') }}</li>
          <li><i class="key drone" aria-hidden="true">✣</i> {{ t('drone and its track') }}</li>
          <li v-if="preview && preview.ok"><i class="key change" aria-hidden="true">▲ ━</i> {{ t('would change, route then') }}</li>
          <li v-if="clashing.length"><i class="key clash" aria-hidden="true">▦</i> {{ t('contradicts an earlier answer') }}</li>
          <li v-if="replaying >= 0"><i class="key flown" aria-hidden="true">●</i> {{ t('how it was flown') }}</li>
          <li v-if="drawing"><i class="key flown" aria-hidden="true">▨</i> {{ t('goes another way') }}</li>
          <li v-if="show.unsure"><i class="key heat" aria-hidden="true">■</i> {{ s.policy && !s.policy.own ? t('the stronger, the more unsure (by the usual weights)') : t('the stronger, the more unsure') }}</li>
        </ul>
        <div class="thumbs" aria-hidden="true" v-if="map && map.layers > 1">
          <div v-for="index in order" :key="index" @click="layer = index" :class="{asked: layers[index].asked.size, shown: index === layer}"><grid-map :map="map" :view="layers[index]" :dark="dark" small></grid-map><span>{{ index + 1 }}</span></div>
        </div>
        <p><a class="to-draw" href="/draw" target="_blank" rel="noopener" data-test="to-draw">{{ t('Draw another grid') }}</a></p>
      </div>
      </div>
    </section>

    <section class="answer card" aria-labelledby="answer-title">
      <h2 id="answer-title" :class="{unseen: options.length}">{{ t('Your answer') }}</h2>
      <div class="options" v-if="options.length && !drawing" role="group" :aria-label="t('Answer at once')">
        <button v-for="(option, index) in options" :key="option.word" type="button" :class="['option', option.meaning ? 'through' : 'keep']" :disabled="!open || sending" :data-test="'option-' + index"
          @click="choose(index)" @mouseenter="consider(index)" @mouseleave="consider(-1)" @focus="consider(index)" @blur="consider(-1)">
          <b>{{ asking.options[index][0] }}</b> <span>{{ asking.options[index][1] }}</span> <small><i aria-hidden="true">{{ option.meaning ? '┅┅' : '━━' }}</i> {{ t('then {steps}', { steps: steps(option.route.length) }) }}</small> <kbd>{{ 'yn'[index] }}</kbd>
        </button>
      </div>
      <compass v-if="!drawing && byDirections && query" :preferred="preferred" :avoided="avoided" :assumed="assumedWrong" :disabled="!open" @prefer="prefer" @avoid="avoid" @clear="clear"></compass>
      <div v-if="drawing" class="draw">
        <p>{{ t('Draw over the cells that go another way than the rest, by finger or mouse; or move by the arrows and mark by x. They are then asked about apart.') }}</p>
        <button type="button" @click="splitItself()">{{ t('Split it for me') }} <kbd>a</kbd></button> <button type="button" @click="mixed()">{{ t('Cancel') }} <kbd>m</kbd></button>
      </div>
      <p class="sentence" aria-live="polite" data-test="sentence" v-if="byDirections">{{ query ? sentence : t('Nothing to answer now.') }}</p>
      <p class="preview" aria-live="polite" v-if="preview || previewing" :class="{bad: worse}" data-test="preview"><b v-if="previewText[0]">{{ previewText[0] }}</b> {{ previewText[1] }}</p>
      <div class="clash" v-if="clashing.length" role="alert" data-test="clash">
        <p><b>⚠ {{ clash && clash.soft ? t('Two answers contradict each other.') : t('This contradicts what was said before.') }}</b> <button type="button" class="quiet" v-if="clashElsewhere()" @click="showClash()">{{ t('Show it on the map') }}</button></p>
        <ul><li v-for="entry in clashing" :key="entry.id">{{ t('Answer {id} by {name}: {said}', { id: entry.id, name: entry.by || t('someone'), said: said(entry) }) }}{{ overlap(entry) ? ', ' + tn('{n} cell of this question', '{n} cells of this question', overlap(entry)) : '' }}
          <button type="button" @click="retract(entry.id)">{{ t('Take back answer {id}', { id: entry.id }) }}</button></li></ul>
        <p v-if="clash && clash.soft"><button type="button" @click="retract(clash.mine)">{{ t('Take back mine ({said})', { said: ours() ? said(ours()) : clash.mine }) }}</button> <button type="button" @click="clash = null">{{ t('Keep both') }}</button> {{ t('The learner weighs them against each other.') }}</p>
        <p v-else-if="!clash">{{ t('Or send it: where the learner allows it, both are kept and weighed against each other.') }}</p>
      </div>
      <div class="row" v-if="byDirections && query">
        <button type="button" class="send" :disabled="!open || !isReady || sending" @click="send()">{{ t('Send') }} <kbd>Enter</kbd></button>
        <button type="button" :disabled="!open" @click="avoidOthers()" v-if="!drawing">{{ t('Others wrong') }} <kbd>o</kbd></button>
        <button type="button" :disabled="!drawing && !preferred.length && !avoided.length" @click="clearPicks()">{{ t('Clear') }} <kbd>⌫</kbd></button>
      </div>
      <p class="kept" v-if="kept.length" data-test="kept">{{ alarm ? tn('{n} answer on the way, kept until the connection is back.', '{n} answers on the way, kept until the connection is back.', kept.length) : tn('{n} answer on the way.', '{n} answers on the way.', kept.length) }}</p>
    </section>
    </div>

    <div class="rest">
    <section class="card more" :aria-label="t('More about this answer')">
      <button type="button" class="quiet" v-if="options.length && !drawing" :aria-expanded="String(byDirections)" data-test="by-directions" @click="named = !named">{{ byDirections ? '▾' : '▸' }} {{ tn('Or name directions in {n} cell', 'Or name directions in {n} cells', query.states.length) }}</button>
      <div class="row">
        <button type="button" :disabled="!open || sending" @click="skip()">{{ t('Skip') }} <kbd>s</kbd></button>
        <button type="button" :disabled="!open || sending" @click="unsure()">{{ t('Unsure') }} <kbd>u</kbd></button>
        <button type="button" :disabled="!open" @click="mixed()" :aria-pressed="String(drawing)">{{ t('These differ') }} <kbd>m</kbd></button>
      </div>
      <label class="note-field">{{ t('Comment') }} <input class="comment" v-model="comment" maxlength="500" :placeholder="t('optional, kept with the answer')"></label>
      <label class="note-field">{{ t('Your name') }} <input v-model="by" maxlength="60" autocomplete="name" :placeholder="t('kept with your answers')"></label>
    </section>
    <section class="card past" aria-labelledby="past-title">
      <h2 id="past-title">{{ t('Answers') }}</h2>
      <p class="progress" data-test="progress">{{ progress }}</p>
      <div class="row"><button type="button" :disabled="!canCommand || !(s.log || []).some((entry) => !entry.retracted)" @click="act('undo')">{{ t('Take the last answer back') }} <kbd>t</kbd></button></div>
      <history :log="s.log" :gains="s.gains" :contradictions="learner.contradictions" :disabled="!canCommand" @retract="retract" @look="looked = $event"></history>
    </section>
    <robot :nodes="s.nodes" :vehicle="s.vehicle" :flight="s.flight" :battery="s.battery" :disabled="!canCommand" @act="act($event)"></robot>
    <teach ref="teach" :link="link" :window="window" :hand="s.hand" :lessons="s.lessons" :map="map" :vehicle="s.vehicle" :disabled="!canCommand" @tell="tell" @act="act($event)"></teach>
    <delivery :link="link" :delivery="s.delivery" :policy="s.policy" :disabled="!canCommand" @tell="tell"></delivery>
    </div>
  </div>
  <p class="toast" role="status" aria-live="assertive" :class="{bad: note && note.bad, shown: note}" data-test="note">{{ note ? note.text : '' }}</p>
</div>`;
