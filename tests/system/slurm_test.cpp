// SPDX-License-Identifier: Apache-2.0
// A whole reconstruction through a real cluster of Slurm with one node, whose host is killed on the way.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int stages = 7;

// slurm_cluster.sh, stopped at the end.
class Cluster {
 public:
  explicit Cluster(fs::path folder) : folder_(std::move(folder)) {
    constexpr int first_port = 20'000;
    constexpr int ports = 10'000;
    const int port = first_port + 2 * (static_cast<int>(::getpid()) % (ports / 2));
    started_ = run_program(script(), {folder_.string(), "start", std::to_string(port)});
    ::setenv("SLURM_CONF", (folder_ / "slurm.conf").c_str(), 1);
  }
  ~Cluster() { run_program(script(), {folder_.string(), "stop"}); }
  Cluster(const Cluster&) = delete;
  Cluster& operator=(const Cluster&) = delete;

  const Finished& started() const { return started_; }

 private:
  static std::string script() { return std::string(GYRE_SYSTEM_TESTS) + "/slurm_cluster.sh"; }
  fs::path folder_;
  Finished started_;
};

// What a job asked for by its stage's estimate is what the stage took, or more.
void expect_asked_enough(const std::string& record, const fs::path& scan) {
  const auto field = [&](const std::string& name) {
    const std::size_t at = record.find(" " + name + "=");
    const std::size_t begin = at + name.size() + 2;
    return at == std::string::npos ? std::string() : record.substr(begin, record.find(' ', begin) - begin);
  };
  const std::string name = field("JobName");
  const std::string asked = field("MinMemoryNode");
  const std::string stage = name.substr(name.rfind('-') + 1);
  ASSERT_FALSE(asked.empty()) << record;
  const double asked_mib = std::stod(asked) * (asked.back() == 'G' ? 1024 : 1);
  const json took = json::parse(read_file(scan / "work" / stage / "stage.json").value_or(""), nullptr, false);
  ASSERT_TRUE(took.is_object()) << stage;
  EXPECT_LE(took.at("peak_memory_mib").get<double>(), asked_mib) << stage;
}

TEST(Slurm, AReconstructionRunsThroughARealClusterThoughItsHostIsKilled) {
  const TemporaryFolder folder;
  const fs::path root = folder.path();
  const Cluster cluster(root / "cluster");
  constexpr int not_here = 77;
  if (cluster.started().code == not_here) GTEST_SKIP() << cluster.started().err;
  ASSERT_EQ(cluster.started().code, 0) << cluster.started().err;
  const auto at = [&](const char* name) { return (root / name).string(); };
  ASSERT_EQ(run_program("synthetic_capture", {at("capture"), "--sequence", "orbit-body", "--frames", "90", "--width",
                                              "270", "--height", "480"})
                .code,
            0);

  std::string endpoint = "tcp://127.0.0.1:*";
  std::string public_key;
  std::unique_ptr<Running> host;
  const auto start_host = [&] {
    fs::remove(root / "ready.json");
    host = std::make_unique<Running>("gyre-offload",
                                     std::vector<std::string>{"serve", "--store", at("host"), "--endpoint", endpoint,
                                                              "--texture-size", "1024", "--executor", "slurm"},
                                     root / "ready.json", root / "host.log");
    const json ready = json::parse(first_line(root / "ready.json", *host));
    endpoint = ready.at("endpoint");
    public_key = ready.at("public_key");
  };
  start_host();
  const Finished paired = run_program("gyre-device", {"pair", "--keys", at("keys"), "--host-public-key", public_key});
  const std::string key = json::parse(paired.out).at("device_public_key");
  ASSERT_EQ(run_program("gyre-offload", {"pair", "--store", at("host"), "--authorise", key, "--name", "rig"}).code, 0);
  Running device("gyre-device",
                 {"replay", at("capture") + "/video.mp4", "--height-mm", "1700", "--host", endpoint, "--keys",
                  at("keys"), "--spool", at("spool"), "--out", at("out")},
                 root / "device.out", root / "device.log");

  // Once the first stage is done, the host goes down hard; the jobs go on without it.
  const auto scan_folder = [&]() -> fs::path {
    for (const auto& entry : fs::directory_iterator(root / "host" / "scans")) return entry.path();
    return {};
  };
  while (!device.ended() && !fs::exists(scan_folder() / "work" / "cameras" / "stage.json")) ::usleep(50'000);
  host->kill_hard();
  start_host();
  ASSERT_EQ(device.wait(), 0) << read_file(root / "device.log").value_or("")
                              << read_file(root / "host.log").value_or("");
  const std::string log = read_file(root / "host.log").value();
  EXPECT_NE(log.find("goes on with"), std::string::npos) << log;

  const std::string avatar = read_file(root / "out" / "avatar.glb").value_or("");
  EXPECT_FALSE(avatar.empty());
  EXPECT_TRUE(read_file(scan_folder() / "avatar.glb").value_or("?") == avatar);
  for (int job = 1; job <= stages; ++job) {
    const Finished record = run_program("/usr/bin/scontrol", {"--oneliner", "show", "job", std::to_string(job)});
    EXPECT_NE(record.out.find("JobState=COMPLETED"), std::string::npos) << record.out << record.err;
    expect_asked_enough(record.out, scan_folder());
  }
  // No stage was submitted twice.
  EXPECT_NE(run_program("/usr/bin/scontrol", {"show", "job", std::to_string(stages + 1)}).code, 0);
  EXPECT_EQ(host->stop(), 0);
}

}  // namespace
}  // namespace gyre
