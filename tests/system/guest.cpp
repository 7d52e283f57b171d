// SPDX-License-Identifier: Apache-2.0
#include "tests/system/guest.h"

#include "common/bundle/atomic_file.h"

#include <gtest/gtest.h>
#include <csignal>
#include <cstdlib>
#include <thread>

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
           ": `./dev test --all` builds one, or set GYRE_UML to a folder with linux and lib/modules";
  for (const char* const program : {"busybox", "modprobe", "python3", "v4l2-ctl"}) {
    if (!is_installed(program)) return std::string("not installed here: ") + program + " (./dev setup --all)";
  }
  return {};
}

// With /usr/bin/env.
std::vector<std::string> Guest::command(const std::string& script, Time time) const {
  EXPECT_TRUE(write_file(out() / "script", script));
  const char* const options = time == Time::virtual_time ? "time-travel=inf-cpu" : "";
  return {"PATIENCE=240",
          std::string("KERNEL_OPTIONS=") + options,
          fs::canonical(sources / "uml/boot.sh").string(),
          fs::canonical(kernel()).string(),
          (out() / "script").string(),
          out().string(),
          std::string("BIN=") + GYRE_BIN};
}

int Guest::run(const std::string& script, Time time) {
  return run_program("/usr/bin/env", command(script, time)).code;
}

void Guest::start(const std::string& script) {
  fs::remove_all(out() / "machine");  // of another one
  running_ = std::make_unique<Running>("/usr/bin/env", command(script, Time::real), out() / "boot", out() / "boot");
}

bool Guest::ended() {
  return running_ == nullptr || running_->ended();
}

void Guest::pull_plug() {
  std::string group;
  while (!ended() && group.find('\n') == std::string::npos) {
    group = read_file(out() / "machine" / "guest" / "pid").value_or("");
    std::this_thread::yield();
  }
  if (!group.empty()) ::kill(-std::stoi(group), SIGKILL);
  if (running_) running_->wait();
  running_.reset();
}

std::string Guest::log() const {
  return read_file(out() / "log").value_or("") + read_file(out() / "console").value_or("");
}

}  // namespace gyre
