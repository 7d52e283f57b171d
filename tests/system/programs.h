// SPDX-License-Identifier: Apache-2.0
// Starts the real programs as a user would and listens to what they say.
#pragma once

#include <sys/types.h>
#include <filesystem>
#include <string>
#include <vector>

namespace gyre {

struct Finished {
  int code = 0;     // exit code, or 128 + signal
  std::string out;  // standard output
  std::string err;  // standard error
};

// Runs gyre-device or gyre-offload (or another program of this build, or one by its absolute path) to its end.
Finished run_program(const std::string& program, const std::vector<std::string>& arguments);

// A program that runs beside the test; killed when it goes out of scope.
class Running {
 public:
  Running(const std::string& program, const std::vector<std::string>& arguments, const std::filesystem::path& out,
          const std::filesystem::path& err);
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running();

  void signal(int number) const;
  void kill_hard();  // SIGKILL and wait
  int stop();        // SIGTERM and wait; the exit code
  bool ended();      // without waiting
  int wait();        // for its own end; the exit code

 private:
  pid_t pid_ = -1;
  int status_ = -1;
};

// First line of a file that a running program writes, once it is there; fails the test when the program ends before.
std::string first_line(const std::filesystem::path& file, Running& program);

std::string last_line(const std::string& text);

}  // namespace gyre
