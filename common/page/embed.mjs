// SPDX-License-Identifier: Apache-2.0
// Turns a built page into C++: embed.mjs FOLDER OUT.cpp NAME
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { extname, join, relative } from "node:path";

const [folder, out, name] = process.argv.slice(2);
const types = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript; charset=utf-8",
  ".css": "text/css; charset=utf-8",
  ".svg": "image/svg+xml",
  ".png": "image/png",
};

function filesIn(path) {
  return readdirSync(path, { withFileTypes: true }).flatMap((entry) =>
    entry.isDirectory() ? filesIn(join(path, entry.name)) : [join(path, entry.name)],
  );
}

// A C++ string literal of any bytes, a short piece a line. Octal escapes have three digits, so that none runs on.
function literal(bytes) {
  const lines = [];
  let line = "";
  for (const byte of bytes) {
    const plain = byte >= 32 && byte < 127 && byte !== 34 && byte !== 92 && byte !== 63;
    line += plain ? String.fromCharCode(byte) : "\\" + byte.toString(8).padStart(3, "0");
    if (line.length > 2000) {
      lines.push(`"${line}"`);
      line = "";
    }
  }
  lines.push(`"${line}"`);
  return lines.join("\n");
}

const entries = filesIn(folder)
  .sort()
  .map((file) => {
    const bytes = readFileSync(file);
    const path = "/" + relative(folder, file).replaceAll("\\", "/");
    const type = types[extname(file)] ?? "application/octet-stream";
    return `    {"${path}", "${type}", std::string_view(\n${literal(bytes)},\n${bytes.length})},`;
  });
writeFileSync(
  out,
  `// SPDX-License-Identifier: Apache-2.0
#include "common/http/http_server.h"

namespace gyre {
extern const std::vector<PageFile>& ${name}();
const std::vector<PageFile>& ${name}() {
  static const std::vector<PageFile> files = {
${entries.join("\n")}
  };
  return files;
}
}  // namespace gyre
`,
);
