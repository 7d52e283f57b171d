// SPDX-License-Identifier: Apache-2.0
// The link at its limits, as JSON lines: link_bench FOLDER [CASE...]
//
//   throughput  256 keyframes of 2 MiB on loopback
//   fleet       8 devices at once, 1,000 scans of 10 small frames
//   finish      files that have come whole, one at a time and as they come
//   line        125 keyframes of 2 MiB over 20 Mbit/s with 50 ms and 1 % loss, between network namespaces (needs root)
//
// Host and devices are processes of their own: this one is the host, link_device.cpp the devices.
#include "common/bundle/bundle.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "common/metrics/process_usage.h"
#include "offload/ingest/batch_worker.h"
#include "offload/ingest/finish_files.h"
#include "offload/ingest/ingest_server.h"
#include "tests/bench/packet_line.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double mib = 1 << 20;

void line(const std::string& name, const char* metric, double value, const char* unit) {
  const nlohmann::ordered_json out = {
      {"bench", "link"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::puts(out.dump().c_str());
  std::fflush(stdout);
}

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

[[noreturn]] void give_up(const std::string& why) {
  std::fprintf(stderr, "link_bench: %s\n", why.c_str());
  std::_Exit(1);
}

template <class T>
T must(Result<T> result) {
  if (!result) give_up(result.error().message());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

struct Work {
  int devices = 1;
  int scans = 1;       // of each device
  int keyframes = 10;  // of each scan
  std::size_t bytes = 2 << 20;
};

// A device's process as the host sees it.
struct Child {
  pid_t pid = -1;
  FILE* to = nullptr;
  FILE* from = nullptr;

  std::string read_line() const {
    std::string text;
    for (int c = 0; (c = std::fgetc(from)) != EOF && c != '\n';) text += static_cast<char>(c);
    return text;
  }
};

Child start(const std::vector<std::string>& words) {
  int in[2];
  int out[2];
  if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) give_up("no pipe");
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::dup2(in[0], STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  return {pid, ::fdopen(in[1], "w"), ::fdopen(out[0], "r")};
}

// Lies beside this program.
fs::path device_program() {
  return fs::read_symlink("/proc/self/exe").parent_path() / "link_device";
}

struct Outcome {
  double seconds = 0;         // of the slowest device
  double host_cpu = 0;        // seconds
  double device_cpu = 0;      // seconds, all devices together
  double device_memory = 0;   // MiB, the most of the largest
  double device_growth = 0;   // MiB, from a fifth of the scans on, of the one that grows most
  double host_memory = 0;     // MiB, the most
  double host_growth = 0;     // MiB, from a fifth of the scans on
  std::vector<double> waits;  // milliseconds
};

// Host on `endpoint` and its devices, each run with `prefix` before its command, until all scans are acknowledged.
Outcome run(const fs::path& folder, const std::string& endpoint, const std::vector<std::string>& prefix,
            const Work& work) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  const auto store = must(Store::open(folder / "store"));
  IngestOptions options;
  options.endpoint = endpoint;
  options.keys = make_key_pair();
  options.allow_list = folder / "devices";
  must(options.check());
  const int all = work.devices * work.scans;
  std::atomic<int> queued = 0;
  std::atomic<double> early = 0;
  IngestServer server(options, *store, [&](const std::string&) {
    if (++queued == std::max(all / 5, 1)) early = resident_bytes();
  });
  std::vector<Child> children;
  std::vector<fs::path> folders;
  for (int i = 0; i < work.devices; ++i) {
    const fs::path mine = folder / ("rig-" + std::to_string(i));
    const KeyPair keys = make_key_pair();
    must(write_key_pair(mine / "device.key", keys));
    must(authorise_device(options.allow_list, "rig-" + std::to_string(i), keys.public_key));
    folders.push_back(mine);
  }
  must(server.start());
  for (const fs::path& mine : folders) {
    std::vector<std::string> words = prefix;
    for (const std::string& word :
         {device_program().string(), mine.string(), server.endpoint(), options.keys.public_key,
          std::to_string(work.scans), std::to_string(work.keyframes), std::to_string(work.bytes)}) {
      words.push_back(word);
    }
    children.push_back(start(words));
  }
  for (const Child& child : children) {
    if (child.read_line() != "ready") give_up("a device did not start");
  }
  const double before = processor_seconds();
  for (const Child& child : children) {
    std::fputs("go\n", child.to);
    std::fflush(child.to);
  }
  Outcome outcome;
  for (const Child& child : children) {
    const json said = json::parse(child.read_line(), nullptr, false);
    if (!said.is_object()) give_up("a device failed");
    outcome.seconds = std::max(outcome.seconds, said.at("seconds").get<double>());
    outcome.device_memory = std::max(outcome.device_memory, said.at("memory_mib").get<double>());
    outcome.device_growth = std::max(outcome.device_growth, said.at("memory_growth_mib").get<double>());
    outcome.device_cpu += said.at("cpu_seconds").get<double>();
    for (const json& wait : said.at("waits_ms")) outcome.waits.push_back(wait);
    std::fclose(child.to);
    std::fclose(child.from);
    ::waitpid(child.pid, nullptr, 0);
  }
  outcome.host_cpu = processor_seconds() - before;
  outcome.host_memory = peak_resident_bytes() / mib;
  outcome.host_growth = (resident_bytes() - early) / mib;
  if (queued != all) give_up("scans were lost or doubled");
  server.stop();
  fs::remove_all(folder);
  return outcome;
}

void throughput(const fs::path& folder) {
  const Work work{1, 1, 256, 2 << 20};
  const Outcome outcome = run(folder / "throughput", "tcp://127.0.0.1:*", {}, work);
  line("throughput", "throughput", 512.0 / outcome.seconds, "MiB/s");
  line("throughput", "host_processor_time", outcome.host_cpu, "s");
  line("throughput", "device_processor_time", outcome.device_cpu, "s");
  line("throughput", "device_memory", outcome.device_memory, "MiB");
  line("throughput", "host_memory", outcome.host_memory, "MiB");
}

void fleet(const fs::path& folder) {
  const Work work{8, 125, 10, 20'000};
  Outcome outcome = run(folder / "fleet", "tcp://127.0.0.1:*", {}, work);
  std::sort(outcome.waits.begin(), outcome.waits.end());
  const auto share = [&](double p) {
    return outcome.waits[static_cast<std::size_t>(p * static_cast<double>(outcome.waits.size() - 1))];
  };
  line("fleet", "scans", work.devices * work.scans, "");
  line("fleet", "seconds", outcome.seconds, "s");
  line("fleet", "acknowledgement_p50", share(0.5), "ms");
  line("fleet", "acknowledgement_p99", share(0.99), "ms");
  line("fleet", "device_memory", outcome.device_memory, "MiB");
  line("fleet", "device_memory_growth", outcome.device_growth, "MiB");
  line("fleet", "host_memory", outcome.host_memory, "MiB");
  line("fleet", "host_memory_growth", outcome.host_growth, "MiB");
}

bool can(const std::string& command) {
  return std::system((command + " 2>/dev/null").c_str()) == 0;
}

void shell(const std::string& command) {
  if (!can(command)) give_up("cannot: " + command);
}

// The host here, the device in a network namespace behind a line with rate, delay and loss both ways: netem's where the
// kernel has it, else one in user space. The case says which, and what governs the device's TCP.
void slow_line(const fs::path& folder) {
  const PacketLineOptions line_options;
  const std::string space = "gyre-bench";
  const std::string here = "gyre-b0";
  const std::string there = "gyre-b1";
  const std::string inside = "ip netns exec " + space + " ";
  const auto clean = [&] {
    can("ip link del " + here);
    can("ip netns del " + space);
  };
  clean();
  shell("ip netns add " + space);
  const std::string netem = " root netem delay 25ms loss 1% rate 20mbit limit 1000";
  shell("ip link add " + here + " type veth peer name " + there + " netns " + space);
  const bool has_netem = can("tc qdisc add dev " + here + netem) && can(inside + "tc qdisc add dev " + there + netem);
  std::unique_ptr<PacketLine> in_user_space;
  if (!has_netem) {
    shell("ip link del " + here);
    in_user_space = must(PacketLine::make(here, there, line_options));
    shell("ip link set " + there + " netns " + space);
  }
  shell("ip addr add 198.18.0.1/30 dev " + here + " && ip link set " + here + " up");
  shell(inside + "ip addr add 198.18.0.2/30 dev " + there + " && " + inside + "ip link set " + there + " up");
  // As the device's package sets it.
  const bool has_bbr = can(inside + "sysctl -qw net.ipv4.tcp_congestion_control=bbr");
  const Work work{1, 1, 125, 2 << 20};
  const Outcome outcome = run(folder / "line", "tcp://198.18.0.1:*", {"ip", "netns", "exec", space}, work);
  clean();
  const double megabits = 125.0 * (2 << 20) * 8.0 / 1e6 / outcome.seconds;
  const std::string name = std::string("line, ") + (has_netem ? "netem" : "in user space") +
                           (has_bbr ? ", bbr" : ", the kernel's usual congestion control");
  line(name, "throughput", megabits, "Mbit/s");
  line(name, "use", megabits / (line_options.bits_per_s / 1e6), "");
  line(name, "device_memory", outcome.device_memory, "MiB");
}

// What the finisher's thread is for: the time the receiving thread is held up by a file that has come whole, when it
// waits for each, and when it leaves them to the finisher; and how many a second that makes.
void finish(const fs::path& folder) {
  constexpr int files = 1000;
  constexpr std::size_t bytes = 20'000;
  for (const bool waits : {true, false}) {
    fs::remove_all(folder / "finish");
    const auto store = must(Store::open(folder / "finish"));
    const auto work = [&](std::vector<ArrivedFile> some) { return finish_files(*store, std::move(some)); };
    BatchWorker<ArrivedFile, FinishedFile> finisher({.waiting = 32}, work, [] {});
    Scan scan;
    scan.id = new_ulid();
    must(store->open_scan(scan, "key", "rig"));
    std::vector<ArrivedFile> arrived;
    for (int i = 0; i < files; ++i) {
      const std::string content(bytes, static_cast<char>('a' + i % 26));
      const std::string name = "frames/" + frame_name("body", i);
      const fs::path part = store->incoming(scan.id) / (std::to_string(i) + ".part");
      std::ofstream(part, std::ios::binary) << content;
      arrived.push_back({scan.id, {name, bytes, sha256(content)}, part});
    }
    const Clock::time_point start = Clock::now();
    std::vector<double> held_up_ms;
    for (ArrivedFile& file : arrived) {
      const Clock::time_point before = Clock::now();
      finisher.add(std::move(file));
      if (waits) finisher.wait();
      held_up_ms.push_back(1000.0 * seconds_since(before));
    }
    finisher.wait();
    const double seconds = seconds_since(start);
    for (const FinishedFile& one : finisher.take()) {
      if (!must(one.stored)) give_up("a file was damaged");
    }
    std::sort(held_up_ms.begin(), held_up_ms.end());
    const std::string name = waits ? "finish, one at a time" : "finish, as they come";
    line(name, "files", files / seconds, "1/s");
    line(name, "held_up_p99", held_up_ms[files * 99 / 100], "ms");
  }
  fs::remove_all(folder / "finish");
}

int bench(const std::vector<std::string>& words) {
  const std::map<std::string, std::function<void(const fs::path&)>> cases = {
      {"throughput", throughput}, {"fleet", fleet}, {"finish", finish}, {"line", slow_line}};
  if (words.empty()) {
    std::fputs("usage: link_bench FOLDER [throughput] [fleet] [finish] [line]\n", stderr);
    return 2;
  }
  std::vector<std::string> chosen(words.begin() + 1, words.end());
  if (chosen.empty()) chosen = {"throughput", "fleet", "finish", "line"};
  for (const std::string& name : chosen) {
    if (!cases.contains(name)) give_up("no such case: " + name);
    cases.at(name)(words[0]);
  }
  return 0;
}

}  // namespace
}  // namespace gyre

int main(int argc, char** argv) {
  spdlog::set_level(spdlog::level::warn);
  return gyre::bench({argv + 1, argv + argc});
}
