// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/pipeline/text_stages.h"

#include "common/bundle/atomic_file.h"
#include "offload/pipeline/planned_stage.h"
#include "offload/pipeline/stage_process.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <csignal>
#include <cstdio>
#include <new>
#include <stdexcept>

namespace gyre {

using nlohmann::json;

std::vector<Stage> text_stages() {
  Stage doubled;
  doubled.name = "double";
  doubled.inputs = {"scan.json"};
  doubled.run = [](const StageContext& c) -> Result<json> {
    const std::string text = *read_file(c.bundle.scan_file());
    if (text == "crash") {
      std::fputs("the last words\n", stderr);
      ::raise(SIGSEGV);
    }
    if (text == "memory") throw std::bad_alloc();
    if (text == "throw") throw std::runtime_error("thrown text");
    if (text == "refuse") return wrong_use("refused text", "scan.json", "write something else");
    if (text == "forever") ::pause();
    while (text == "wait" && !std::filesystem::exists(c.bundle.root() / "go")) ::usleep(10'000);
    c.progress(0.5, "half way");
    if (Result<void> w = write_file(c.out / "text", text + text); !w) return tl::unexpected(w.error());
    return json{{"length", 2 * text.size()}};
  };
  Stage shout;
  shout.name = "shout";
  shout.inputs = {"work/double"};
  shout.external = {"extra"};
  shout.options = {{"marks", 1}, {"extra", ""}};
  shout.published = {"avatar.glb"};
  shout.run = [](const StageContext& c) -> Result<json> {
    const std::string text =
        *read_file(c.bundle.work("double") / "text") + std::string(c.options.at("marks").get<std::size_t>(), '!');
    if (Result<void> w = write_file(c.out / "avatar.glb", text); !w) return tl::unexpected(w.error());
    return json::object();
  };
  return {doubled, shout};
}

}  // namespace gyre

// The runner starts this same executable as a stage's worker.
int main(int argc, char** argv) {
  if (argc > 5 && std::string(argv[1]) == "stage") {
    if (std::string(argv[4]) == "--plan")
      return gyre::run_planned_stage(gyre::text_stages(), argv[2], gyre::Bundle(argv[3]), argv[5]);
    for (const gyre::Stage& stage : gyre::text_stages()) {
      if (stage.name != argv[2]) continue;
      gyre::StageContext context{gyre::Bundle(argv[3]), argv[5], nlohmann::json::parse(argv[7])};
      return gyre::run_stage_worker(stage, std::move(context));
    }
    return 2;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
