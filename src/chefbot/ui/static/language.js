// The web UI in the reader's language. A message is identified by its English text; a catalogue of `languages/` has the
// translations of the web UI's texts, of the robot's sentences, and of names. {names} in braces stand for what changes.
const KEY = "chefbot-language";
export const LANGUAGES = { en: "English", de: "Deutsch", fr: "Français", es: "Español", ar: "العربية", zh: "中文" };
const RIGHT_TO_LEFT = new Set(["ar"]);
const ATTRIBUTES = ["aria-label", "title", "placeholder"];
const PATIENCE = 3000;                   // milliseconds for a catalogue to arrive
const LONGEST = 500;                     // characters: comparing longer texts could keep the web UI from STOP
const DEPTH = 3;                         // of sentences within sentences
const LONG = new Set(["reason", "trays"]);   // what stands for sentences or a list; other {names} end with theirs

export const language = recall() ?? preferred();
export let loadError = "";
const { page, robot, names } = language === "en" ? { page: {}, robot: {}, names: {} } : await load();
const sentences = patterns(robot, (name) => (LONG.has(name) ? ".+?" : "(?:(?![.?!;:] ).)+?"));
const namePatterns = patterns(names, () => "\\S+");
let labels = {}, labelled = null;        // what the owner calls places, by name; the names in a sentence

// A text of the web UI, with values in place of its {names}.
export function tr(message, values = {}) {
  return filled(page[message] ?? message, (name) => values[name]);
}

// A sentence of the robot, or several; one that the catalogue does not have stays English.
export function translated(text, depth = DEPTH) {
  if (!text || language === "en" || text.length > LONGEST) return relabelled(text);
  const clauses = (one) => one.split("; ").map((clause) => sentence(clause, depth) ?? relabelled(clause)).join("; ");
  return sentence(text, depth) ?? text.split(/(?<=[.?!])\s+/).map((one) => sentence(one, depth) ?? clauses(one)).join(" ");
}

// Take the labels of places, which the reader sees instead of their names.
export function setLabels(value) {
  labels = value;
  const known = Object.keys(value).sort((a, b) => b.length - a.length).map((name) => name.replace(/_/g, "[_ ]"));
  labelled = known.length ? new RegExp(`\\b(?:${known.join("|")})\\b`, "gi") : null;
}

// A sentence about places as they were called when it was written.
export function translatedAsWritten(text) {
  const present = [labels, labelled];
  [labels, labelled] = [{}, null];
  try { return translated(text); } finally { [labels, labelled] = present; }
}

// A text with the labels of the places that it names; a sentence of the catalogue takes them as its parts.
function relabelled(text) { return labelled && text ? text.replace(labelled, (name) => labels[key(name)]) : text; }
function label(name) { return Object.hasOwn(labels, key(name)) ? labels[key(name)] : null; }
function key(name) { return name.toLowerCase().replace(/ /g, "_"); }

// Between the parts of a list, and at the end of a sentence.
export const comma = { ar: "، ", zh: "、" }[language] ?? ", ";
const FULL_STOP = { zh: "。" }[language] ?? ".";

// The name of a place for the reader: table_3 is "Table 3", or "Tisch 3", unless it has a label.
export function title(name) {
  return Object.hasOwn(labels, name) ? labels[name] : nameTitle(name);
}

// The same without the labels of the present map.
export function nameTitle(name) {
  const text = capital(name.replace(/_/g, " "));
  return matched(text, namePatterns, 0) ?? text;
}

// Choose a language, unless the browser keeps no settings. The page is loaded again, because its texts are made once.
export function choose(code) {
  try { localStorage.setItem(KEY, code); } catch { return false; }
  location.reload();
  return true;
}

// The translation of one sentence, or null; it begins in lower case after a colon, what is a part of others elsewhere
// ends with a full stop, and the catalogue has one form.
function sentence(text, depth) {
  const cased = (one) => matched(one, sentences, depth) ?? matched(capital(one), sentences, depth)
    ?? capital(matched(lower(one), sentences, depth));
  const whole = cased(text), part = whole || !text.endsWith(".") ? null : cased(text.slice(0, -1));
  return part ? part + FULL_STOP : whole;
}

// A sentence without its full stop, which within another one would end that.
export function withoutStop(text) { return text.replace(/[.。](?=\u2069*$)/, ""); }

// The translation of a text by the most specific pattern that it matches, or null.
function matched(text, known, depth) {
  for (const { expression, translation } of known) {
    const found = expression.exec(text);
    if (found) return filled(translation, (name) => part(found.groups[name], depth - 1));
  }
  return null;
}

// A part of a sentence: a name, a number or topic, a list of these, another sentence or several.
function part(text, depth) {
  if (depth < 0) return relabelled(text);
  const name = (one) => label(one) ?? (/^(\d+|\/\S+)$/.test(one) ? one : matched(capital(one.replace(/_/g, " ")), namePatterns, 0));
  const whole = name(text) ?? sentence(text, depth);
  if (whole) return whole;
  if (/[.?!]\s/.test(text)) return translated(text, depth);
  if (text.includes("; ")) return text.split("; ").map((one) => part(one, depth)).join("; ");
  // In a list of places, what only the owner calls so has no translation and stays as it is.
  const parts = text.split(/, | and /), names = parts.map(name);
  if (!names.some(Boolean)) return translated(text, depth);
  return new Intl.ListFormat(language).format(parts.map((one, i) => isolated(names[i] ?? relabelled(one))));
}

function patterns(messages, capture) {
  const expression = (message) => message.replace(/[.*+?^$()|[\]\\]/g, "\\$&").replace(/\{(\w+)\}/g, (_, name) => `(?<${name}>${capture(name)})`);
  const fixed = ([message]) => message.replace(/\{\w+\}/g, "").length;
  return Object.entries(messages).sort((a, b) => fixed(b) - fixed(a))
    .map(([message, translation]) => ({ expression: new RegExp(`^${expression(message)}$`, "s"), translation }));
}

function filled(template, value) { return template.replace(/\{(\w+)\}/g, (_, name) => isolated(value(name))); }

// In a text from right to left, "8 m" keeps its order (Unicode Standard Annex 9, first strong isolate).
export function isolated(value) { return RIGHT_TO_LEFT.has(language) ? `\u2068${value}\u2069` : String(value); }
function lower(text) { return text.replace(/^./u, (letter) => letter.toLowerCase()); }
function capital(text) { return text && text.replace(/^./u, (letter) => letter.toUpperCase()); }

// A catalogue that does not arrive costs the translation, not the web UI: STOP soon works in English.
async function load() {
  try {
    const answer = await fetch(`languages/${language}.json`, { signal: AbortSignal.timeout(PATIENCE) });
    if (!answer.ok) throw new Error(`status ${answer.status}`);
    return await answer.json();
  } catch (error) {
    loadError = `The texts in ${LANGUAGES[language]} could not be loaded: ${error.message}`;
    return { page: {}, robot: {}, names: {} };
  }
}

// A browser that blocks cookies refuses this, too; the web UI then follows the browser's languages.
function recall() {
  try { return supported(localStorage.getItem(KEY)); } catch { return null; }
}

function preferred() {
  return navigator.languages.map((tag) => supported(tag.split("-")[0])).find(Boolean) ?? "en";
}

function supported(code) { return Object.hasOwn(LANGUAGES, code ?? "") ? code : null; }

// Translate the texts of index.html, before the other modules add to it.
function translatePage() {
  document.documentElement.lang = loadError ? "en" : language;
  document.documentElement.dir = RIGHT_TO_LEFT.has(language) && !loadError ? "rtl" : "ltr";
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const node = texts.currentNode, text = node.data.trim();
    if (text) node.data = node.data.replace(text, () => tr(text.replace(/\s+/g, " ")));
  }
  for (const name of ATTRIBUTES) {
    for (const element of document.querySelectorAll(`[${name}]`)) element.setAttribute(name, tr(element.getAttribute(name)));
  }
}
translatePage();
