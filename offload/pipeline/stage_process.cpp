// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/stage_process.h"

#include "common/log/log_format.h"
#include "offload/pipeline/child_pipe.h"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <optional>

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
  bool memory = false;  // the error is a lack of memory

  void hear(const std::string& line, const Progress& progress) {
    const json said = json::parse(line, nullptr, false);
    if (!said.is_object()) return;
    if (said.contains("fraction")) progress(said["fraction"].get<double>(), said.value("what", ""));
    if (said.contains("result")) result = said["result"];
    if (said.contains("error")) {
      const json& e = said["error"];
      error = Error{e.value("what", ""), e.value("where", ""), e.value("remedy", ""),
                    e.value("usage", false) ? Error::Kind::usage : Error::Kind::failed};
      memory = said.value("memory", false);
    }
  }
};

// Hands on what the worker writes to stderr and keeps the last of it.
struct StandardError {
  static constexpr std::size_t kept_bytes = 64 << 10;
  std::string kept;
  std::string begun;  // a line that has not ended yet

  // By whole lines, so that those of several stages do not mix.
  void hear(const std::string& text) {
    begun += text;
    for (std::size_t end = begun.find('\n'); end != std::string::npos; end = begun.find('\n')) {
      hand_on_log_line(std::string_view(begun).substr(0, end));
      begun.erase(0, end + 1);
    }
    kept += text;
    if (kept.size() > 2 * kept_bytes) kept.erase(0, kept.size() - kept_bytes);
  }
  void end() const {
    if (!begun.empty()) hand_on_log_line(begun);
  }
};

tl::unexpected<PipelineFailure> cannot_start(const Stage& stage) {
  PipelineFailure failure{
      {"cannot start the stage", stage.name + " (" + std::strerror(errno) + ")", "free some memory and try again"}};
  failure.cause = FailureCause::lost;
  failure.stage = stage.name;
  return tl::unexpected(failure);
}

// How the process ended, when that was not well.
std::optional<PipelineFailure> verdict(const Stage& stage, int status, const Conversation& said, bool cancelled) {
  PipelineFailure failure;
  failure.stage = stage.name;
  const auto ended = [&](std::string what, std::string remedy, FailureCause cause) {
    static_cast<Error&>(failure) = Error{std::move(what), stage.name, std::move(remedy), Error::Kind::failed};
    failure.cause = cause;
    return failure;
  };
  if (cancelled) return ended("cancelled", "", FailureCause::cancelled);
  if (said.error) {
    static_cast<Error&>(failure) = *said.error;
    failure.cause = said.memory ? FailureCause::memory : FailureCause::stage;
    return failure;
  }
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    const bool killed = signal == SIGKILL;
    return ended("the stage was ended by signal " + std::string(::strsignal(signal)),
                 killed ? "it may have run out of memory: lower --memory-gib or the number of keyframes"
                        : "its messages are in the log",
                 killed ? FailureCause::memory : FailureCause::crash);
  }
  if (WEXITSTATUS(status) == 0) return std::nullopt;
  return ended("the stage ended with code " + std::to_string(WEXITSTATUS(status)), "its messages are in the log",
               FailureCause::crash);
}

std::vector<std::string> worker_command(const Stage& stage, const StageContext& context) {
  // This very executable, also when the file has been replaced by an update since.
  return {"/proc/self/exe", "stage",
          stage.name,       context.bundle.root().string(),
          "--worker",       context.out.string(),
          "--options-json", context.options.dump(),
          "--threads",      std::to_string(context.threads),
          "--memory-gib",   std::to_string(context.memory_gib),
          "--seed",         std::to_string(context.seed),
          "--log-level",    std::string(spdlog::level::to_string_view(spdlog::get_level()).data()),
          "--log-format",   log_format() == LogFormat::json ? "json" : "text"};
}

}  // namespace

tl::expected<StageOutcome, PipelineFailure> run_stage_process(const Stage& stage, const StageContext& context,
                                                              const Ask& ask) {
  std::vector<std::string> words = worker_command(stage, context);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  ChildPipe out;
  ChildPipe err;
  if (!out.open() || !err.open()) return cannot_start(stage);
  const auto start = std::chrono::steady_clock::now();
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    // Only async-signal-safe calls between fork and exec.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    ::dup2(out.writing(), STDOUT_FILENO);
    ::dup2(err.writing(), STDERR_FILENO);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  if (child < 0) return cannot_start(stage);
  out.close_writing();
  err.close_writing();

  Conversation conversation;
  StandardError messages;
  std::string pending;
  bool cancelled = false;
  while (out.reading() >= 0 || err.reading() >= 0) {
    if (!cancelled && ask() != Order::go_on) {
      cancelled = true;
      ::kill(child, SIGKILL);
    }
    std::array<pollfd, 2> waiting = {{{out.reading(), POLLIN, 0}, {err.reading(), POLLIN, 0}}};
    constexpr int look_for_cancel_ms = 200;
    if (::poll(waiting.data(), waiting.size(), look_for_cancel_ms) <= 0) continue;
    if (waiting[0].revents != 0) out.read_into(pending);
    if (waiting[1].revents != 0) {
      std::string text;
      err.read_into(text);
      messages.hear(text);
    }
    for (std::size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      conversation.hear(pending.substr(0, end), context.progress);
      pending.erase(0, end + 1);
    }
  }

  messages.end();
  int status = 0;
  rusage usage{};
  while (::wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  if (std::optional<PipelineFailure> failure = verdict(stage, status, conversation, cancelled)) {
    failure->log = std::move(messages.kept);
    return tl::unexpected(std::move(*failure));
  }
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
  bool memory = false;
  try {
    result = stage.run(context);
  } catch (const std::bad_alloc&) {
    memory = true;
    result = fail("out of memory", stage.name, "lower --memory-gib or the number of keyframes");
  } catch (const std::exception& e) {
    result = fail("the stage failed unexpectedly", stage.name + " (" + e.what() + ")");
  }
  if (!result) {
    const Error& e = result.error();
    say({{"memory", memory},
         {"error",
          {{"what", e.what}, {"where", e.where}, {"remedy", e.remedy}, {"usage", e.kind == Error::Kind::usage}}}});
    return e.exit_code();
  }
  say({{"result", *result}});
  return 0;
}

}  // namespace gyre
