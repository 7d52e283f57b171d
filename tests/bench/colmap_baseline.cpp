// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/colmap_baseline.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cstdlib>
#include <fstream>

namespace gyre::bench {

namespace fs = std::filesystem;

namespace {

double children_cpu() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// Runs a program with its output in `log`; CPU seconds.
Result<double> run(std::vector<std::string> arguments, const fs::path& log) {
  std::vector<char*> argv;
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  const double before = children_cpu();
  const pid_t child = fork();
  if (child == 0) {
    setenv("QT_QPA_PLATFORM", "offscreen", 1);
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || status != 0)
    return fail("colmap " + arguments[1] + " failed", log.string(), "read its log");
  return children_cpu() - before;
}

}  // namespace

bool colmap_is_installed() {
  return std::system("command -v colmap > /dev/null") == 0;
}

Result<ColmapRun> run_colmap(const fs::path& pictures, const std::vector<std::pair<std::string, std::string>>& pairs,
                             const fs::path& work) {
  fs::remove_all(work);
  fs::create_directories(work / "sparse");
  const std::string database = work / "database.db";
  const fs::path log = work / "colmap.log";
  ColmapRun result;
  const auto extraction = run({"colmap", "feature_extractor", "--database_path", database, "--image_path", pictures,
                               "--ImageReader.single_camera", "1", "--SiftExtraction.use_gpu", "0"},
                              log);
  if (!extraction) return tl::unexpected<Error>(extraction.error());
  result.extraction = *extraction;

  std::vector<std::string> matcher{"colmap", "exhaustive_matcher"};
  if (!pairs.empty()) {
    std::ofstream list(work / "pairs.txt");
    for (const auto& [a, b] : pairs) list << a << ' ' << b << '\n';
    matcher = {"colmap", "matches_importer", "--match_type", "pairs", "--match_list_path", work / "pairs.txt"};
  }
  for (const std::string& a :
       {std::string("--database_path"), database, std::string("--SiftMatching.use_gpu"), std::string("0")})
    matcher.push_back(a);
  const auto matching = run(matcher, log);
  if (!matching) return tl::unexpected<Error>(matching.error());
  result.matching = *matching;

  const auto mapping =
      run({"colmap", "mapper", "--database_path", database, "--image_path", pictures, "--output_path", work / "sparse"},
          log);
  if (!mapping) return tl::unexpected<Error>(mapping.error());
  result.mapping = *mapping;
  for (const auto& entry : fs::directory_iterator(work / "sparse")) {
    const fs::path text = work / "text" / entry.path().filename();
    fs::create_directories(text);
    const auto converted =
        run({"colmap", "model_converter", "--input_path", entry.path(), "--output_path", text, "--output_type", "TXT"},
            log);
    if (!converted) return tl::unexpected<Error>(converted.error());
    auto model = read_colmap_model(text);
    if (!model) return tl::unexpected<Error>(model.error());
    if (model->images.size() > result.model.images.size()) result.model = std::move(*model);
  }
  if (result.model.images.empty()) return fail("colmap made no model", log.string(), "read its log");
  return result;
}

}  // namespace gyre::bench
