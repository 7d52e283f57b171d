// SPDX-License-Identifier: Apache-2.0
#include "tests/system/guest.h"

#include "common/bundle/atomic_file.h"
#include "tests/system/programs.h"

#include <cstdlib>

namespace gyre {

namespace {

namespace fs = std::filesystem;

const fs::path sources = GYRE_SYSTEM_TESTS;

fs::path kernel() {
  const char* const given = std::getenv("GYRE_UML");
  return given != nullptr ? fs::path(given) : sources / "../../../shared/testing/uml-dist";
}

bool is_installed(const char* program) {
  for (const char* const folder : {"/bin", "/sbin", "/usr/bin", "/usr/sbin"}) {
    if (fs::exists(fs::path(folder) / program)) return true;
  }
  return false;
}

}  // namespace

std::string Guest::lacking() {
  if (!fs::exists(kernel() / "linux"))
    return "no user-mode Linux kernel at " + kernel().string() +
           ": set GYRE_UML to a folder with linux and lib/modules";
  for (const char* const program : {"busybox", "modprobe", "python3", "v4l2-ctl"}) {
    if (!is_installed(program)) return std::string("not installed here: ") + program + " (./dev setup --all)";
  }
  return {};
}

int Guest::run(const std::string& script, Time time) {
  if (!write_file(out() / "script", script)) return -1;
  const fs::path boot = sources / "uml/boot.sh";
  const char* const options = time == Time::virtual_time ? "time-travel=inf-cpu" : "";
  return run_program("/usr/bin/env", {"PATIENCE=240", std::string("KERNEL_OPTIONS=") + options,
                                      fs::canonical(boot).string(), fs::canonical(kernel()).string(),
                                      (out() / "script").string(), out().string(), std::string("BIN=") + GYRE_BIN})
      .code;
}

std::string Guest::log() const {
  return read_file(out() / "log").value_or("") + read_file(out() / "console").value_or("");
}

}  // namespace gyre
