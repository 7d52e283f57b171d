// SPDX-License-Identifier: Apache-2.0
// A device and a host that suffer random faults, one after another, while scans go up and avatars come back. In the end
// nothing is lost, nothing is doubled, and every byte is what it was. The seed is printed; GYRE_FAULT_SEED sets it, and
// GYRE_FAULTS how many faults there are.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/keys/keys.h"
#include "device/spool/spool.h"
#include "offload/store/store.h"
#include "tests/offload/ingest/tcp_proxy.h"
#include "tests/system/fault_control.h"
#include "tests/system/fault_scans.h"
#include "tests/system/message_relay.h"
#include "tests/system/programs.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>
#include <csignal>
#include <cstdlib>
#include <new>

namespace gyre {
namespace {

namespace fs = std::filesystem;

enum class Fault {
  kill_host,
  kill_device,
  tear_host,  // killed, and what was not synced is cut off or lost
  tear_device,
  cut_line,
  full_disk,
  host_clock,
  device_clock,
  double_messages,
  reorder_messages,
  slow_host,
  slow_line,
};
constexpr int kinds_of_fault = 12;

// Mapped by a program as well.
class Control {
 public:
  explicit Control(const fs::path& file) : file_(file) {
    const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    EXPECT_EQ(::ftruncate(fd, sizeof(FaultControl)), 0);
    mapped_ = ::mmap(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    ::close(fd);
    control_ = new (mapped_) FaultControl;
  }
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;
  ~Control() { ::munmap(mapped_, sizeof(FaultControl)); }
  FaultControl* operator->() const { return control_; }
  const fs::path& file() const { return file_; }

 private:
  fs::path file_;
  void* mapped_ = nullptr;
  FaultControl* control_ = nullptr;
};

// The newest file below `folder` that nobody has promised to keep: half received.
std::optional<fs::path> newest_part(const fs::path& folder) {
  std::optional<fs::path> newest;
  fs::file_time_type when{};
  std::error_code error;
  for (auto it = fs::recursive_directory_iterator(folder, error); !error && it != fs::recursive_directory_iterator();
       it.increment(error)) {
    if (!it->is_regular_file(error) || it->path().extension().string().rfind(".part", 0) != 0) continue;
    if (newest && it->last_write_time(error) < when) continue;
    newest = it->path();
    when = it->last_write_time(error);
  }
  return newest;
}

class FaultRun : public testing::Test {
 protected:
  void SetUp() override {
    const char* seed = std::getenv("GYRE_FAULT_SEED");
    seed_ = seed != nullptr ? static_cast<unsigned>(std::stoul(seed)) : std::random_device{}();
    std::printf("GYRE_FAULT_SEED=%u\n", seed_);
    std::fflush(stdout);
    random_.seed(seed_);
    for (const char* side : {"host", "device"}) fs::create_directories(root_ / side);
    const KeyPair host = make_key_pair();
    const KeyPair device = make_key_pair();
    ASSERT_TRUE(write_key_pair(root_ / "host" / "host.key", host));
    ASSERT_TRUE(write_public_key(root_ / "device" / "host.pub", host.public_key));
    ASSERT_TRUE(write_key_pair(root_ / "device" / "device.key", device));
    ASSERT_TRUE(authorise_device(root_ / "host" / "devices", "rig", device.public_key));
    start_host();
    to_host_ = std::make_unique<TcpProxy>(std::stoi(endpoint_.substr(endpoint_.rfind(':') + 1)));
    relay_ = std::make_unique<MessageRelay>(host, device, to_host_->endpoint(), seed_, [this] {
      if (to_relay_) to_relay_->cut_after(0);
    });
    to_relay_ = std::make_unique<TcpProxy>(relay_->port());
    start_device();
  }
  void TearDown() override {
    host_.reset();
    device_.reset();
    relay_.reset();  // it speaks to the proxies until then
    if (HasFailure()) {
      for (const char* log : {"host.log", "device.log"}) {
        const std::string text = read_file(root_ / log).value_or("");
        constexpr std::size_t tail = 20'000;
        std::printf("--- end of %s\n%s\n", log, text.substr(text.size() > tail ? text.size() - tail : 0).c_str());
      }
    }
  }

  std::unique_ptr<Running> start(const std::string& role, const std::string& endpoint, const Control& control) {
    ::setenv("LD_PRELOAD", GYRE_FAULT_SHIM, 1);
    ::setenv(fault_control_variable, control.file().c_str(), 1);
    auto program =
        std::make_unique<Running>("fault_peer", std::vector<std::string>{role, (root_ / role).string(), endpoint},
                                  root_ / (role + ".out"), root_ / (role + ".log"));
    ::unsetenv("LD_PRELOAD");
    ::unsetenv(fault_control_variable);
    return program;
  }
  void start_host() {
    fs::remove(root_ / "host.out");
    host_ = start("host", endpoint_, host_control_);
    if (endpoint_.back() == '*') endpoint_ = first_line(root_ / "host.out", *host_);
  }
  void start_device() { device_ = start("device", to_relay_->endpoint(), device_control_); }

  std::uint64_t below(std::uint64_t n) { return random_() % n; }

  // Waits until so much has gone over the line, or for a while when nothing does.
  void let_go(std::uint64_t bytes) {
    const std::uint64_t goal = to_relay_->carried() + bytes;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    while (to_relay_->carried() < goal && std::chrono::steady_clock::now() < end && !device_->ended()) ::usleep(1000);
  }

  // What a power cut does to a file that was not synced: its end is missing, or is there as zeros.
  void tear(const fs::path& folder) {
    const std::optional<fs::path> file = newest_part(folder);
    if (!file) return;
    const std::uint64_t size = fs::file_size(*file);
    const std::uint64_t kept = below(size + 1);
    fs::resize_file(*file, kept);
    if (below(2) == 0) fs::resize_file(*file, size);
  }
  // And to a journal: a line that was being added is there in part.
  void tear_journal() {
    std::optional<fs::path> newest;
    for (const auto& scan : fs::directory_iterator(root_ / "device" / "spool")) {
      const fs::path journal = scan.path() / "spool.jsonl";
      if (fs::exists(journal) && (!newest || newest->parent_path().filename() < scan.path().filename()))
        newest = journal;
    }
    if (newest) std::ofstream(*newest, std::ios::app) << R"({"event":"fi)";
  }

  void inflict(Fault fault) {
    switch (fault) {
      case Fault::kill_host:
      case Fault::tear_host:
        host_->kill_hard();
        if (fault == Fault::tear_host) tear(root_ / "host" / "store" / "incoming");
        return start_host();
      case Fault::kill_device:
      case Fault::tear_device:
        device_->kill_hard();
        if (fault == Fault::tear_device) {
          tear(root_ / "device" / "spool");
          tear_journal();
        }
        return start_device();
      case Fault::cut_line:
        return (below(2) == 0 ? to_relay_ : to_host_)->cut_after(below(300'000));
      case Fault::full_disk:
        host_control_->disk_full = 1;
        let_go(below(50'000));
        host_control_->disk_full = 0;
        return;
      case Fault::host_clock:
      case Fault::device_clock: {
        constexpr std::array<std::int64_t, 5> jumps_s = {0, 3600, -3600, 864'000, -864'000};
        const Control& control = fault == Fault::host_clock ? host_control_ : device_control_;
        control->clock_offset_s = jumps_s.at(below(jumps_s.size()));
        return;
      }
      case Fault::double_messages:
        return relay_->double_next(20);
      case Fault::reorder_messages:
        return relay_->reorder_next(20);
      case Fault::slow_host:
        host_->signal(SIGSTOP);
        // One in four is longer than the device waits.
        ::usleep(static_cast<useconds_t>(below(4) == 0 ? 2'500'000 : below(400'000)));
        return host_->signal(SIGCONT);
      case Fault::slow_line:
        (below(2) == 0 ? to_relay_ : to_host_)->limit(200'000 + below(2'000'000));
        let_go(below(200'000));
        to_relay_->limit(0);
        return to_host_->limit(0);
    }
  }

  void run(int faults) {
    const char* asked = std::getenv("GYRE_FAULTS");
    if (asked != nullptr) faults = std::stoi(asked);
    std::array<int, kinds_of_fault> counts{};
    for (int i = 0; i < faults; ++i) {
      let_go(below(600'000));
      // Every kind comes, whatever the seed.
      const int kind = i < kinds_of_fault ? i : static_cast<int>(below(kinds_of_fault));
      ++counts.at(static_cast<std::size_t>(kind));
      inflict(static_cast<Fault>(kind));
      ASSERT_FALSE(device_->ended()) << "the device gave up after fault " << i;
      ASSERT_FALSE(host_->ended()) << "the host gave up after fault " << i;
    }
    ASSERT_TRUE(write_file(root_ / "device" / "enough", ""));
    ASSERT_EQ(device_->wait(), 0);
    host_->kill_hard();
    std::string told;
    for (const int count : counts) told += std::to_string(count) + " ";
    std::printf("faults of each kind: %s\n", told.c_str());
    compare();
  }

  // Both ends against what was recorded, which follows from the numbers of the scans.
  void compare() {
    const auto spool = Spool::open(root_ / "device" / "spool", 0).value();
    const auto store = Store::open(root_ / "host" / "store").value();
    const std::vector<std::string> recorded = spool->scan_ids();
    const std::vector<StoredScan> stored = store->scans().value();
    std::printf("scans: %zu\n", recorded.size());
    ASSERT_GT(recorded.size(), 1U);
    ASSERT_EQ(stored.size(), recorded.size());
    EXPECT_EQ(store->jobs()->size(), recorded.size());
    for (std::size_t number = 0; number < recorded.size(); ++number) {
      const std::string id = fault_scan(static_cast<int>(number)).id;
      SCOPED_TRACE("scan " + id);
      EXPECT_EQ(stored[number].id, id);
      EXPECT_EQ(stored[number].phase, StorePhase::done);
      EXPECT_TRUE(store->verify(id)->empty());
      EXPECT_FALSE(fs::exists(store->incoming(id)));
      const Bundle sent = spool->bundle(id);
      const Bundle received = store->bundle(id);
      EXPECT_EQ(spool->phase(id), SpoolPhase::delivered);
      std::map<std::string, std::string> truth;
      for (const int frame : fault_keyframes()) {
        truth[frame_name("body", frame)] = sha256(fault_frame(static_cast<int>(number), frame));
      }
      EXPECT_EQ(hashes_in(received.frames()), truth);
      EXPECT_EQ(hashes_in(sent.frames()), truth);
      for (const char* file : {"scan.json", "frames.jsonl", "avatar.glb", "report.json"}) {
        EXPECT_TRUE(read_file(sent.root() / file).value() == read_file(received.root() / file).value()) << file;
      }
      EXPECT_TRUE(read_file(sent.root() / "avatar.glb").value() == fault_avatar(received).value());
    }
  }

  static std::map<std::string, std::string> hashes_in(const fs::path& folder) {
    std::map<std::string, std::string> hashes;
    for (const auto& file : fs::directory_iterator(folder)) {
      hashes[file.path().filename().string()] = sha256_of_file(file.path()).value();
    }
    return hashes;
  }

  TemporaryFolder folder_;
  fs::path root_ = folder_.path();
  unsigned seed_ = 0;
  std::mt19937 random_;
  Control host_control_{root_ / "host.control"};
  Control device_control_{root_ / "device.control"};
  std::string endpoint_ = "tcp://127.0.0.1:*";
  std::unique_ptr<TcpProxy> to_host_, to_relay_;
  std::unique_ptr<MessageRelay> relay_;
  std::unique_ptr<Running> host_, device_;
};

TEST_F(FaultRun, TwentyFiveFaultsLoseAndDoubleNothing) {
  run(25);
}

TEST_F(FaultRun, SlowFiveHundredFaultsLoseAndDoubleNothing) {
  run(500);
}

}  // namespace
}  // namespace gyre
