// SPDX-License-Identifier: Apache-2.0
#include "tests/system/programs.h"

#include "common/bundle/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <csignal>

namespace gyre {

namespace {

pid_t start(const std::string& program, const std::vector<std::string>& arguments, const std::filesystem::path& out,
            const std::filesystem::path& err) {
  std::vector<std::string> words = {(std::filesystem::path(GYRE_BIN) / program).string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int to_out = ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    const int to_err = ::open(err.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    ::dup2(to_out, STDOUT_FILENO);
    ::dup2(to_err, STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  return child;
}

int exit_code_of(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

Finished run_program(const std::string& program, const std::vector<std::string>& arguments) {
  const std::filesystem::path base = std::filesystem::path(testing::TempDir()) / ("said-" + std::to_string(::getpid()));
  const std::filesystem::path out = base.string() + ".out";
  const std::filesystem::path err = base.string() + ".err";
  std::filesystem::remove(err);
  Finished finished;
  finished.code = Running(program, arguments, out, err).wait();
  finished.out = read_file(out).value_or("");
  finished.err = read_file(err).value_or("");
  std::filesystem::remove(out);
  std::filesystem::remove(err);
  return finished;
}

Running::Running(const std::string& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& out, const std::filesystem::path& err)
    : pid_(start(program, arguments, out, err)) {}

Running::~Running() {
  kill_hard();
}

void Running::signal(int number) const {
  if (pid_ >= 0) ::kill(pid_, number);
}

void Running::kill_hard() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);
  wait();
}

int Running::stop() {
  if (pid_ >= 0) ::kill(pid_, SIGTERM);
  return wait();
}

bool Running::ended() {
  if (pid_ >= 0 && ::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = -1;
  return pid_ < 0;
}

int Running::wait() {
  if (pid_ >= 0) {
    while (::waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
  }
  return exit_code_of(status_);
}

std::string first_line(const std::filesystem::path& file, Running& program) {
  while (true) {
    const bool over = program.ended();
    const std::string text = read_file(file).value_or("");
    if (const std::size_t end = text.find('\n'); end != std::string::npos) return text.substr(0, end);
    if (over) {
      ADD_FAILURE() << "the program ended without a word";
      return {};
    }
    std::this_thread::yield();
  }
}

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n');
  if (end == std::string::npos) return {};
  const std::size_t before = text.rfind('\n', end);
  return text.substr(before == std::string::npos ? 0 : before + 1,
                     end - (before == std::string::npos ? 0 : before + 1) + 1);
}

}  // namespace gyre
