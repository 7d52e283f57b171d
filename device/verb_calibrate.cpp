// SPDX-License-Identifier: Apache-2.0
#include "common/board/board.h"
#include "common/board/board_pdf.h"
#include "common/bundle/atomic_file.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

struct CalibrateFlags {
  std::string board_pdf;
  std::string paper = "a4";
};

int calibrate(const CalibrateFlags& given) {
  // Files are written under another name and renamed, which would take the place of a printer's device.
  std::error_code absent;
  const auto there = std::filesystem::status(given.board_pdf, absent);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there))
    return report_error(wrong_use("not a file", given.board_pdf, "name the PDF file to write").value());
  const std::string pdf = board_pdf(given.paper == "a4" ? Paper::a4 : Paper::letter);
  if (const Result<void> written = write_file(given.board_pdf, pdf); !written) return report_error(written.error());
  const nlohmann::json line = {{"board_pdf", std::filesystem::absolute(given.board_pdf).string()},
                               {"board", board_version},
                               {"paper", given.paper}};
  std::printf("%s\n", line.dump().c_str());
  return 0;
}

}  // namespace

void add_calibrate_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<CalibrateFlags>();
  CLI::App* verb = app.add_subcommand("calibrate", "write the board that gives scans their scale, to be printed");
  verb->add_option("--board-pdf", flags->board_pdf, "PDF file to write the board to; replaced when it is there")
      ->required();
  verb->add_option("--paper", flags->paper, "paper it will be printed on")
      ->check(CLI::IsMember({"a4", "letter"}))
      ->capture_default_str();
  verb->callback([flags, &run] { run = [flags] { return calibrate(*flags); }; });
}

}  // namespace gyre
