// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/stage_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <cstring>

namespace gyre {

namespace {

using nlohmann::json;

double seconds_of(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

// What a worker said on its standard output.
struct Conversation {
  json result;
  std::optional<Error> error;

  void hear(const std::string& line, const Progress& progress) {
    const json said = json::parse(line, nullptr, false);
    if (!said.is_object()) return;
    if (said.contains("fraction")) progress(said["fraction"].get<double>(), said.value("what", ""));
    if (said.contains("result")) result = said["result"];
    if (said.contains("error")) {
      const json& e = said["error"];
      error = Error{e.value("what", ""), e.value("where", ""), e.value("remedy", ""),
                    e.value("usage", false) ? Error::Kind::usage : Error::Kind::failed};
    }
  }
};

std::vector<std::string> worker_command(const Stage& stage, const StageContext& context) {
  // This very executable, also when the file has been replaced by an update since.
  return {"/proc/self/exe", "stage",
          stage.name,       context.bundle.root().string(),
          "--worker",       context.out.string(),
          "--options-json", context.options.dump(),
          "--threads",      std::to_string(context.threads),
          "--memory-gib",   std::to_string(context.memory_gib),
          "--seed",         std::to_string(context.seed),
          "--log-level",    std::string(spdlog::level::to_string_view(spdlog::get_level()).data())};
}

}  // namespace

Result<StageOutcome> run_stage_process(const Stage& stage, const StageContext& context,
                                       const std::atomic<bool>& cancel) {
  std::vector<std::string> words = worker_command(stage, context);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    return fail("cannot start the stage", stage.name + " (" + std::strerror(errno) + ")");
  const auto start = std::chrono::steady_clock::now();
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    // Only async-signal-safe calls between fork and exec.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    ::dup2(ends[1], STDOUT_FILENO);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  ::close(ends[1]);
  if (child < 0) {
    ::close(ends[0]);
    return fail("cannot start the stage", stage.name + " (" + std::strerror(errno) + ")",
                "free some memory and try again");
  }

  Conversation conversation;
  std::string pending;
  bool cancelled = false;
  for (bool open = true; open;) {
    if (cancel && !cancelled) {
      cancelled = true;
      ::kill(child, SIGKILL);
    }
    pollfd waiting{ends[0], POLLIN, 0};
    constexpr int look_for_cancel_ms = 200;
    const int ready = ::poll(&waiting, 1, look_for_cancel_ms);
    if (ready <= 0) continue;
    std::array<char, 4096> block{};
    const ssize_t got = ::read(ends[0], block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    open = got > 0;
    if (open) pending.append(block.data(), static_cast<std::size_t>(got));
    for (std::size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      conversation.hear(pending.substr(0, end), context.progress);
      pending.erase(0, end + 1);
    }
  }
  ::close(ends[0]);

  int status = 0;
  rusage usage{};
  while (::wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  if (cancelled) return fail("cancelled", stage.name);
  if (conversation.error) return tl::unexpected(*conversation.error);
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return fail("the stage was ended by signal " + std::string(::strsignal(signal)), stage.name,
                signal == SIGKILL ? "it may have run out of memory: lower --memory-gib or the number of keyframes"
                                  : "its messages are in the log");
  }
  if (WEXITSTATUS(status) != 0)
    return fail("the stage ended with code " + std::to_string(WEXITSTATUS(status)), stage.name,
                "its messages are in the log");

  StageOutcome outcome;
  outcome.result = std::move(conversation.result);
  outcome.usage.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  outcome.usage.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  outcome.usage.peak_memory_mib = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return outcome;
}

int run_stage_worker(const Stage& stage, StageContext context) {
  std::mutex mutex;
  const auto say = [&](const json& what) {
    const std::string line = what.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
    const std::scoped_lock lock(mutex);
    for (std::size_t sent = 0; sent < line.size();) {
      const ssize_t n = ::write(STDOUT_FILENO, line.data() + sent, line.size() - sent);
      if (n < 0 && errno != EINTR) return;
      if (n > 0) sent += static_cast<std::size_t>(n);
    }
  };
  context.progress = [&](double fraction, std::string_view what) { say({{"fraction", fraction}, {"what", what}}); };
  Result<json> result = fail("the stage failed", stage.name);
  try {
    result = stage.run(context);
  } catch (const std::bad_alloc&) {
    result = fail("out of memory", stage.name, "lower --memory-gib or the number of keyframes");
  } catch (const std::exception& e) {
    result = fail("the stage failed unexpectedly", stage.name + " (" + e.what() + ")");
  }
  if (!result) {
    const Error& e = result.error();
    say({{"error",
          {{"what", e.what}, {"where", e.where}, {"remedy", e.remedy}, {"usage", e.kind == Error::Kind::usage}}}});
    return e.exit_code();
  }
  say({{"result", *result}});
  return 0;
}

}  // namespace gyre
