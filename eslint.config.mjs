// What the linter refuses; the compiler of TypeScript checks the types.
const browser = ["document", "window", "globalThis", "location", "history", "navigator", "matchMedia", "addEventListener", "removeEventListener",
  "requestAnimationFrame", "ResizeObserver", "IntersectionObserver", "getComputedStyle", "setTimeout", "clearTimeout", "performance", "URL", "Blob", "Response", "Worker",
  "DecompressionStream", "Option", "HTMLElement", "HTMLSelectElement", "HTMLInputElement", "atob", "structuredClone", "WebAssembly", "self",
  "postMessage", "onmessage", "Buffer", "console", "process", "Event"];

export default [
  {
    files: ["src/saltus/web/page/*.js", "tests/web/*.js", "tests/web/*.mjs"],
    languageOptions: { ecmaVersion: 2023, sourceType: "module", globals: Object.fromEntries(browser.map((name) => [name, "readonly"])) },
    rules: {
      "no-undef": "error", "no-unused-vars": "error", "prefer-const": "error", eqeqeq: ["error", "always", { null: "ignore" }],
      "no-var": "error", "no-eval": "error", "no-implied-eval": "error", "no-new-func": "error", "no-shadow": "off",
      "no-unsafe-finally": "error", "no-unreachable": "error", "no-dupe-keys": "error", "no-fallthrough": "error",
      "no-restricted-properties": ["error", ...["innerHTML", "outerHTML", "insertAdjacentHTML"].map((property) => ({ property }))],
      "max-lines": ["error", 700], "max-lines-per-function": ["error", 60], complexity: ["error", 24],
    },
  },
];
