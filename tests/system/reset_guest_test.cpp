// SPDX-License-Identifier: Apache-2.0
// A whole machine that is reset at random moments: a user-mode Linux kernel (tests/system/uml) with a sensor, a button,
// the device's daemon and a host is killed while scans are taken. What its programs had not synced was in its memory
// and is gone, on both sides. The seed is printed; GYRE_FAULT_SEED sets it, and GYRE_CUTS how often. Skipped without a
// kernel.
#include "common/bundle/atomic_file.h"
#include "common/keys/keys.h"
#include "tests/system/guest.h"
#include "tests/system/spool_view.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Boots into a rig that waits for its button. OUT/begun is there then, and OUT/started is what it has said so far.
const char* const to_a_waiting_rig = R"(
  modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0
  until_true 10 test -c /dev/video0
  v4l2-ctl -d /dev/video0 -c horizontal_movement=5
  plug_panel
  $BIN/fault_peer host $OUT/host tcp://127.0.0.1:7410 >$OUT/ready 2>$OUT/host.log &
  until_true 60 grep -q tcp: $OUT/ready
  printf '[run]\ncamera = "v4l2:/dev/video0?size=320x180"\nhost = "tcp://127.0.0.1:7410"\n' >/tmp/rig.toml
  printf 'page = "off"\nheight-mm = 1700\nkeys = "%s/keys"\nspool = "%s/spool"\n' "$OUT" "$OUT" >>/tmp/rig.toml
  printf '[panel]\nbutton = "!GYRE_BUTTON"\ngreen = "GYRE_GREEN"\n' >>/tmp/rig.toml
  $BIN/gyre-device --config /tmp/rig.toml run 2>$OUT/device & daemon=$!
  until_true 60 grep -q 'waiting for the button' $OUT/device
  state() { sed -nE 's/.* on [a-z_]+: ([a-z_]+)$/\1/p' $OUT/device | tail -n 1; }
  cp $OUT/device $OUT/started
  sync $OUT/started
  touch $OUT/begun
)";

// Passes of three seconds, one after the other.
const char* const scans_without_end = R"(
  while :; do
    case $(state) in
      arming | finishing) ;;
      pass) rest 3; press 0.1 ;;
      *) press 0.1 ;;
    esac
    rest 0.3
  done
)";

// What is open is closed, and all of it goes up.
const char* const the_end = R"(
  press 1.5
  until_true 60 eval 'case $(state) in "" | idle | waiting_for_host | avatar_ready) true ;; *) press 1.5; false ;; esac'
  all_delivered() {
    local journal
    for journal in $OUT/spool/*/spool.jsonl; do
      ! grep -q '"closed"' $journal || grep -q '"delivered"' $journal || return 1
    done
  }
  until_true 90 all_delivered
  kill -TERM $daemon
  wait $daemon
)";

class ResetGuest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string lacking = Guest::lacking(); !lacking.empty()) GTEST_SKIP() << lacking;
    const char* const seed = std::getenv("GYRE_FAULT_SEED");
    seed_ = seed != nullptr ? static_cast<unsigned>(std::stoul(seed)) : std::random_device{}();
    std::printf("GYRE_FAULT_SEED=%u\n", seed_);
    std::fflush(stdout);
    for (const char* const folder : {"host", "keys", "spool"}) fs::create_directories(guest_.out() / folder);
    const KeyPair host = make_key_pair(), device = make_key_pair();
    ASSERT_TRUE(write_key_pair(guest_.out() / "host" / "host.key", host));
    ASSERT_TRUE(write_public_key(guest_.out() / "keys" / "host.pub", host.public_key));
    ASSERT_TRUE(write_key_pair(guest_.out() / "keys" / "device.key", device));
    ASSERT_TRUE(authorise_device(guest_.out() / "host" / "devices", "rig", device.public_key));
  }

  fs::path spool() const { return guest_.out() / "spool"; }
  fs::path received() const { return guest_.out() / "host" / "store" / "scans"; }
  std::string said(const std::string& file) const { return read_file(guest_.out() / file).value_or(""); }

  void boot(const std::string& then) {
    for (const char* const left : {"begun", "started", "ready", "device"}) fs::remove(guest_.out() / left);
    guest_.start(to_a_waiting_rig + then);
  }

  // The rig waits for its button, after a reset that left `before`. False: not within that time.
  bool starts_clean(const SpoolView& before, Clock::time_point until) {
    while (!fs::exists(guest_.out() / "begun")) {
      if (guest_.ended()) ADD_FAILURE() << guest_.log() << said("device") << said("host.log");
      if (guest_.ended() || Clock::now() > until) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    const std::string log = said("started");
    EXPECT_EQ(log.find(" error "), std::string::npos) << log;
    ++starts_;
    expect_explained(before, view_spool(spool()), log);
    return true;
  }

  void run(int resets) {
    if (const char* const asked = std::getenv("GYRE_CUTS")) resets = std::stoi(asked);
    std::mt19937 random;
    SpoolView before;
    SpoolView::Files acknowledged;
    auto begun = Clock::now();
    boot(scans_without_end);
    ASSERT_TRUE(starts_clean(before, Clock::time_point::max()));
    auto booting = Clock::now() - begun;
    guest_.pull_plug();
    before = view_spool(spool());
    // Resets are spread over a boot and scans of twice that time. How long a boot takes changes with what else the
    // machine does.
    constexpr double boots = 3.0;
    for (int i = 0; i < resets && !HasFailure(); ++i) {
      random.seed(seed_ + static_cast<unsigned>(i));
      SCOPED_TRACE("reset " + std::to_string(i) + " of seed " + std::to_string(seed_));
      const double moment = std::uniform_real_distribution<double>(0.0, boots)(random);
      begun = Clock::now();
      const auto until = begun + std::chrono::duration_cast<Clock::duration>(moment * booting);
      boot(scans_without_end);
      const bool has_started = starts_clean(before, until);
      const auto took = Clock::now() - begun;
      booting = has_started ? took : std::max(booting, took);
      if (has_started) std::this_thread::sleep_until(until);
      guest_.pull_plug();
      std::printf("reset %d of %d: %.1f boots after the start\n", i + 1, resets, moment);
      std::fflush(stdout);
      before = view_spool(spool());
      expect_whole(before.keyframes(), spool());
      expect_whole(before.acknowledged(), received());
      for (const auto& [name, hash] : before.acknowledged()) acknowledged[name] = hash;
    }
    std::printf("resets: %d, clean starts: %d; acknowledged meanwhile: %zu keyframes\n", resets, starts_,
                acknowledged.size());
    boot(the_end);
    ASSERT_TRUE(starts_clean(before, Clock::time_point::max()));
    while (!guest_.ended()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(said("exit-code"), "0\n") << guest_.log() << said("device") << said("host.log");
    const SpoolView all = view_spool(spool());
    expect_tidy(all, spool());
    std::printf("scans: %d\n", expect_delivered(all, acknowledged, received()));
  }

  Guest guest_;
  unsigned seed_ = 0;
  int starts_ = 0;
};

TEST_F(ResetGuest, TwoResetsLoseNothing) {
  run(2);
}

TEST_F(ResetGuest, SlowFiftyResetsLoseNothing) {
  run(50);
}

}  // namespace
}  // namespace gyre
