// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/command.h"

#include "offload/pipeline/child_pipe.h"

#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

namespace gyre {

Result<CommandOutcome> run_command(const std::vector<std::string>& words, std::chrono::milliseconds patience) {
  using Clock = std::chrono::steady_clock;
  std::vector<std::string> copy = words;
  std::vector<char*> arguments;
  arguments.reserve(copy.size() + 1);
  for (std::string& word : copy) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ChildPipe out;
  ChildPipe err;
  const bool piped = out.open() && err.open();
  const pid_t child = piped ? ::fork() : -1;
  if (child == 0) {
    ::dup2(out.writing(), STDOUT_FILENO);
    ::dup2(err.writing(), STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }
  if (child < 0) return fail("cannot start a program", words[0] + " (" + std::strerror(errno) + ")");
  out.close_writing();
  err.close_writing();
  CommandOutcome outcome;
  const Clock::time_point end = Clock::now() + patience;
  bool killed = false;
  while (out.reading() >= 0 || err.reading() >= 0) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) {
      killed = true;
      ::kill(child, SIGKILL);
      break;
    }
    std::array<pollfd, 2> waiting = {{{out.reading(), POLLIN, 0}, {err.reading(), POLLIN, 0}}};
    if (::poll(waiting.data(), waiting.size(), static_cast<int>(left)) <= 0) continue;
    if (waiting[0].revents != 0) out.read_into(outcome.out);
    if (waiting[1].revents != 0) err.read_into(outcome.err);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (killed) return fail("a program does not answer", words[0]);
  constexpr int signal_base = 128;
  constexpr int not_found = 127;
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : signal_base + WTERMSIG(status);
  if (outcome.code == not_found) return fail("cannot start a program", words[0], "install it, or add it to PATH");
  return outcome;
}

}  // namespace gyre
