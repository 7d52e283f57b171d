// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"
#include "offload/report/evaluate.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

namespace gyre {

void add_evaluate_verb(CLI::App& app, Verb& run) {
  struct Flags {
    std::string bundle;
    std::string truth;
    EvaluateOptions options;
  };
  const auto flags = std::make_shared<Flags>();
  CLI::App* verb = app.add_subcommand("evaluate", "measure a reconstruction against the truth; prints JSON");
  verb->add_option("bundle", flags->bundle, "folder of the scan")->required();
  verb->add_option("--truth", flags->truth, "folder of the subject with orbit-body, orbit-head, turn")->required();
  verb->add_option("--template", flags->options.body_template,
                   "human template the avatar was made with; default: as for reconstruct");
  verb->callback([flags, &run] {
    run = [flags] {
      const Result<nlohmann::json> figures = evaluate(Bundle(flags->bundle), flags->truth, flags->options);
      if (!figures) return report_error(figures.error());
      std::printf("%s\n", figures->dump(2).c_str());
      return 0;
    };
  });
}

}  // namespace gyre
