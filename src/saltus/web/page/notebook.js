/**
 * The view of an explorer in a notebook, as anywidget asks for it: the page in a frame of its own, whose scripts reach nothing of
 * the notebook, and messages that keep the page and the widget's model the same.
 */

const AGREED = ["values", "start", "periods"];

/**
 * @typedef {object} Model  The widget's model, which Python has too.
 * @property {(name: string) => any} get @property {(name: string, value: any) => void} set @property {() => void} save_changes
 * @property {(event: string, act: () => void) => void} on @property {(event: string, act: () => void) => void} off
 */

/** Show an explorer in an element; returns what takes it away. @param {{model: Model, el: HTMLElement}} view */
export function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.title = `${model.get("title")}: a page that computes`;
  frame.setAttribute("sandbox", "allow-scripts allow-downloads");
  Object.assign(frame.style, { width: "100%", height: `${model.get("height")}px`, border: "1px solid #9996", display: "block", colorScheme: "normal" });
  frame.srcdoc = model.get("page");
  const send = (/** @type {any} */ message) => frame.contentWindow?.postMessage({ saltus: message }, "*");
  const agreed = () => Object.fromEntries(AGREED.map((name) => [name, model.get(name)]));
  const heard = (/** @type {MessageEvent} */ event) => {
    const said = event.source === frame.contentWindow && event.data?.saltus;
    if (!said) return;
    if (said.ready) return send({ ...agreed(), results: model.get("results"), theme: themeOf(el) });
    for (const name of AGREED) if (name in said) model.set(name, said[name]);
    model.save_changes();
  };
  const changed = () => send(agreed());
  const grown = () => send({ results: model.get("results") });
  addEventListener("message", heard);
  for (const name of AGREED) model.on(`change:${name}`, changed);
  model.on("change:results", grown);
  el.append(frame);
  return () => {
    removeEventListener("message", heard);
    for (const name of AGREED) model.off(`change:${name}`, changed);
    model.off("change:results", grown);
    frame.remove();
  };
}

/** Whether the notebook writes light on dark. @param {HTMLElement} el */
function themeOf(el) {
  const [red = 0, green = 0, blue = 0] = (getComputedStyle(el).color.match(/[\d.]+/g) ?? []).map(Number);
  return red + green + blue > 384 ? "dark" : "light";
}

export default { render };
