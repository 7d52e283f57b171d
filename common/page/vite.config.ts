// SPDX-License-Identifier: Apache-2.0
// Builds the page in the folder given on the command line; what both pages share lies here.
import { defineConfig } from "vite";

export default defineConfig({
  base: "/",
  build: {
    target: "es2022",
    // One script and one style sheet by their content's name; nothing that the content security policy forbids.
    assetsInlineLimit: 0,
    modulePreload: false,
    emptyOutDir: true,
    chunkSizeWarningLimit: 1500,
  },
});
