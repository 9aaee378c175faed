/* Unpack the joined modules of the page, and run them: as a plain script, as Firefox imports no module from memory in a file. */
const packed = Uint8Array.from(atob((document.getElementById("script")?.textContent ?? "").trim()), (letter) => letter.charCodeAt(0));
const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
const script = document.createElement("script");
script.src = URL.createObjectURL(new Blob([await new Response(stream).arrayBuffer()], { type: "text/javascript" }));
script.addEventListener("load", () => URL.revokeObjectURL(script.src));
document.head.append(script);
export {};
