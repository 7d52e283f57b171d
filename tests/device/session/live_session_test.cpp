// SPDX-License-Identifier: Apache-2.0
// Whole scans on a rig whose camera is a texture: with one button, through faults, and over power cuts at every state.
#include "device/session/live_session.h"

#include "common/bundle/atomic_file.h"
#include "common/keys/keys.h"
#include "device/session/session_store.h"
#include "tests/device/live_scene.h"
#include "tests/device/moving_scene.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <condition_variable>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <thread>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using Kind = OperatorCommand::Kind;
using State = SessionState;

// The library makes it on first use, in a way that the thread sanitizer does not see: before there are threads, then.
const auto logger = spdlog::default_logger();

// A session that runs beside the test.
class Rig {
 public:
  Rig(LiveSession::Cameras cameras, const fs::path& folder, const LiveSessionOptions& options = quick(),
      const Uplink* uplink = nullptr)
      : Rig(std::move(cameras), folder, options, uplink, open_spool(folder)) {}
  Rig(LiveSession::Cameras cameras, const fs::path& folder, const LiveSessionOptions& options, const Uplink* uplink,
      std::shared_ptr<Spool> spool)
      : spool_(std::move(spool)), session_(std::move(cameras), *spool_, folder, uplink, options) {
    session_.on_status([this](const LiveStatus& status) {
      {
        const std::lock_guard lock(mutex_);
        status_ = status;
        if (states_.empty() || states_.back() != status.state) states_.push_back(status.state);
      }
      changed_.notify_all();
    });
    thread_ = std::thread([this] {
      Result<SessionEnd> end = session_.run();
      {
        const std::lock_guard lock(mutex_);
        end_ = std::move(end);
      }
      changed_.notify_all();
    });
  }
  ~Rig() {
    session_.stop();
    thread_.join();
  }

  static LiveSessionOptions quick() {
    LiveSessionOptions options;
    options.device = "rig";
    options.height_mm = 1700.0;
    options.settle = std::chrono::milliseconds(100);
    options.ladder.between_reopens = 0.02;
    options.room = []() -> Result<std::uint64_t> { return std::uint64_t{1} << 30; };
    return options;
  }
  static std::shared_ptr<Spool> open_spool(const fs::path& folder) {
    Result<std::unique_ptr<Spool>> spool = Spool::open(folder);
    EXPECT_TRUE(spool) << (spool ? "" : spool.error().message());
    return std::move(*spool);
  }

  template <class Predicate>
  LiveStatus wait_until(const Predicate& is_so, const std::string& what) {
    constexpr std::chrono::seconds patience{120};
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, patience, [&] { return is_so(status_); }))
        << what << "; state " << name_of(status_.state) << ", " << status_.notice << status_.fault;
    return status_;
  }
  LiveStatus wait_for(State state) {
    return wait_until([=](const LiveStatus& status) { return status.state == state; }, std::string(name_of(state)));
  }
  LiveStatus wait_for_frames(int frames) {
    return wait_until([=](const LiveStatus& status) { return status.state == State::pass && status.frames >= frames; },
                      std::to_string(frames) + " frames");
  }
  void press() { session_.post({Kind::press, std::nullopt}); }
  void post(Kind kind) { session_.post({kind, std::nullopt}); }
  LiveSession& session() { return session_; }
  Spool& spool() { return *spool_; }

  Result<SessionEnd> end() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return end_.has_value(); });
    return *end_;
  }
  std::vector<State> states() const {
    const std::lock_guard lock(mutex_);
    return states_;
  }

 private:
  std::shared_ptr<Spool> spool_;
  LiveSession session_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  LiveStatus status_;
  std::vector<State> states_;
  std::optional<Result<SessionEnd>> end_;
  std::thread thread_;
};

CameraFactory recording(int frames) {
  return [frames]() -> Result<std::unique_ptr<CameraDevice>> { return std::make_unique<test::MovingScene>(frames); };
}

class LiveSessionTest : public testing::Test {
 protected:
  // As with the logger: the codecs are made on first use.
  static void SetUpTestSuite() { EXPECT_TRUE(cv::haveImageWriter(".jpg")); }

  CameraFactory live() {
    return [this]() -> Result<std::unique_ptr<CameraDevice>> {
      if (!switches_.is_there) return fail("no such camera", "scene", "plug it in");
      return std::make_unique<test::LiveScene>(switches_);
    };
  }
  LiveSession::Cameras live_cameras() { return {{"", live()}}; }
  fs::path folder() const { return folder_.path() / "spool"; }

  // What a power cut would leave: the files as they are now, in another folder. Some may go while they are copied.
  fs::path cut(const std::string& name) {
    const fs::path to = folder_.path() / name;
    std::error_code gone;
    for (auto it = fs::recursive_directory_iterator(folder(), gone); !gone && it != fs::recursive_directory_iterator();
         it.increment(gone)) {
      std::error_code ignored;
      const fs::path copy = to / fs::relative(it->path(), folder());
      if (it->is_directory(ignored)) {
        fs::create_directories(copy, ignored);
      } else {
        fs::create_directories(copy.parent_path(), ignored);
        fs::copy_file(it->path(), copy, ignored);
      }
    }
    return to;
  }

  static void expect_bundle(Spool& spool, const std::string& scan, std::size_t passes) {
    const Bundle bundle = spool.bundle(scan);
    EXPECT_EQ(spool.phase(scan), SpoolPhase::closed);
    const Result<void> verified = verify_bundle(bundle);
    EXPECT_TRUE(verified) << verified.error().message();
    const Result<Scan> written = read_scan(bundle);
    ASSERT_TRUE(written);
    EXPECT_EQ(written->passes.size(), passes);
    EXPECT_EQ(written->height_mm, 1700.0);
  }

  // A scan whose body pass is closed, and the store that says so.
  void record_body() {
    Rig rig(live_cameras(), folder());
    rig.press();
    rig.wait_for_frames(120);
    rig.press();
    scan_ = rig.wait_for(State::between_passes).scan;
  }
  static void say_state(const fs::path& folder, State state) {
    const SessionStore store(folder);
    std::optional<StoredSession> stored = store.load();
    ASSERT_TRUE(stored);
    stored->state = state;
    ASSERT_TRUE(store.save(*stored));
  }

  TemporaryFolder folder_;
  test::SceneSwitches switches_;
  std::string scan_;
};

TEST_F(LiveSessionTest, RecordingsBecomeAScanWithTwoPresses) {
  Rig rig({{"", recording(150)}, {"head", recording(90)}}, folder());
  rig.press();
  const LiveStatus between = rig.wait_for(State::between_passes);
  EXPECT_EQ(between.pass, "head");
  EXPECT_EQ(between.frames, 150);
  rig.press();
  rig.wait_for(State::idle);
  expect_bundle(rig.spool(), between.scan, 2);
  EXPECT_EQ(read_frame_log(rig.spool().bundle(between.scan))->size(), 240U);
  EXPECT_TRUE(rig.session().preview());
  const std::vector<State> expected = {State::idle,      State::arming,         State::pass,
                                       State::finishing, State::between_passes, State::arming,
                                       State::pass,      State::finishing,      State::idle};
  // Some states are too brief to be shown.
  std::size_t at = 0;
  for (const State state : rig.states()) {
    while (at < expected.size() && expected[at] != state) ++at;
    ASSERT_LT(at, expected.size()) << name_of(state);
  }
}

TEST_F(LiveSessionTest, ALiveCameraRecordsUntilThePressAndALongPressEndsTheScan) {
  Rig rig(live_cameras(), folder());
  rig.press();
  rig.wait_for_frames(150);
  rig.press();
  const LiveStatus between = rig.wait_for(State::between_passes);
  rig.post(Kind::cancel);
  rig.wait_for(State::idle);
  expect_bundle(rig.spool(), between.scan, 1);
  EXPECT_GE(list_frames(rig.spool().bundle(between.scan))->size(), 20U);
}

// A table that turns by one radian a second; the machine's clock shows `zero` when the frames' shows 0.
class LiveTurn : public LiveSessionTest {
 protected:
  static constexpr double zero = 100.0;

  LiveTurn() : table_({.memory = 1e9}) {
    for (int i = 0; i < 20'000; ++i) table_.add(zero + 0.1 * i, std::remainder(0.1 * i, 2 * M_PI));
  }
  LiveSessionOptions options() const {
    LiveSessionOptions options = Rig::quick();
    options.mode = "turn";
    options.turntable = &table_;
    return options;
  }

  TurntableAngle table_;
};

TEST_F(LiveTurn, TheTurntableSaysTheAzimuthOfEveryFrame) {
  switches_.time_zero = zero;
  Rig rig(live_cameras(), folder(), options());
  rig.press();
  const auto is_done = [](const LiveStatus& status) { return status.is_raised(Condition::done); };
  const LiveStatus done = rig.wait_until(is_done, "the whole turn");
  ASSERT_TRUE(done.azimuth);
  EXPECT_LE(*done.azimuth, -2 * M_PI + 0.02);
  EXPECT_EQ(done.band, Band::body_upper);
  for (const CellStatus& cell : done.cells[static_cast<std::size_t>(Band::body_upper)]) EXPECT_TRUE(cell.is_covered);
  rig.press();
  rig.wait_for(State::idle);
  expect_bundle(rig.spool(), done.scan, 1);
  const Result<std::vector<FrameRecord>> records = read_frame_log(rig.spool().bundle(done.scan));
  ASSERT_TRUE(records);
  for (const FrameRecord& record : *records) {
    ASSERT_TRUE(record.azimuth) << record.index;
    EXPECT_NEAR(*record.azimuth, -record.time * 180.0 / M_PI, 1e-3) << record.index;
  }
}

TEST_F(LiveTurn, OfACameraWithoutAClockNoAzimuthIsTold) {
  Rig rig(live_cameras(), folder(), options());
  rig.press();
  const LiveStatus status = rig.wait_for_frames(60);
  EXPECT_FALSE(status.azimuth);
  for (const CellStatus& cell : status.cells[static_cast<std::size_t>(Band::body_upper)]) EXPECT_FALSE(cell.is_seen);
}

TEST_F(LiveSessionTest, LittleMemoryCostsNoMoreThanItsShareOfKeyframes) {
  LiveSessionOptions options = Rig::quick();
  options.recorder.memory = 40'000;  // a dozen pictures
  Rig rig(live_cameras(), folder(), options);
  rig.press();
  rig.wait_for_frames(240);
  rig.press();
  const std::string scan = rig.wait_for(State::between_passes).scan;
  rig.post(Kind::cancel);
  rig.wait_for(State::idle);
  expect_bundle(rig.spool(), scan, 1);
  EXPECT_GE(list_frames(rig.spool().bundle(scan))->size(), 20U);
}

TEST_F(LiveSessionTest, APassThatNobodyEndsIsClosedWhenItIsFull) {
  LiveSessionOptions options = Rig::quick();
  options.recorder.most_frames = 130;
  Rig rig(live_cameras(), folder(), options);
  rig.press();
  const LiveStatus between = rig.wait_for(State::between_passes);
  EXPECT_EQ(between.frames, 130);
  EXPECT_NE(between.notice.find("ended at 130 frames"), std::string::npos) << between.notice;
  EXPECT_NE(between.notice.find("keyframes of 130 frames"), std::string::npos) << between.notice;
  rig.post(Kind::cancel);
  rig.wait_for(State::idle);
  expect_bundle(rig.spool(), between.scan, 1);
  EXPECT_EQ(read_frame_log(rig.spool().bundle(between.scan))->size(), 130U);
}

TEST_F(LiveSessionTest, ACancelledPassLeavesNothingAndTheNextOneIsWhole) {
  Rig rig(live_cameras(), folder());
  rig.press();
  rig.wait_for_frames(60);
  rig.post(Kind::cancel);
  rig.wait_for(State::idle);
  for (const std::string& id : rig.spool().scan_ids()) EXPECT_TRUE(list_frames(rig.spool().bundle(id))->empty());
  rig.press();
  rig.wait_for_frames(120);
  rig.press();
  const std::string scan = rig.wait_for(State::between_passes).scan;
  rig.post(Kind::cancel);
  rig.wait_for(State::idle);
  EXPECT_EQ(rig.spool().scan_ids(), std::vector<std::string>{scan});
  expect_bundle(rig.spool(), scan, 1);
}

TEST_F(LiveSessionTest, APassWithoutMovementIsSaidAndDropped) {
  switches_.moves = false;
  Rig rig(live_cameras(), folder());
  rig.press();
  rig.wait_for_frames(40);
  rig.press();
  const LiveStatus idle = rig.wait_for(State::idle);
  EXPECT_NE(idle.notice.find("did not move"), std::string::npos) << idle.notice;
}

TEST_F(LiveSessionTest, ACameraThatIsLostInMidPassIsWaitedFor) {
  Rig rig(live_cameras(), folder());
  rig.press();
  rig.wait_for_frames(60);
  switches_.is_there = false;
  const auto is_lost = [](const LiveStatus& status) { return status.is_raised(Condition::camera_lost); };
  const LiveStatus lost = rig.wait_until(is_lost, "lost");
  EXPECT_EQ(lost.state, State::pass);
  EXPECT_EQ(lost.signal, signal_of(Condition::camera_lost));
  switches_.is_there = true;
  rig.wait_for_frames(lost.frames + 60);
  rig.press();
  rig.wait_for(State::between_passes);
}

TEST_F(LiveSessionTest, ACameraThatIsNotThereIsSaidAndWaitedFor) {
  switches_.is_there = false;
  Rig rig(live_cameras(), folder());
  const LiveStatus fault = rig.wait_for(State::fault);
  EXPECT_NE(fault.fault.find("plug it in"), std::string::npos) << fault.fault;
  switches_.is_there = true;
  rig.wait_for(State::idle);
}

TEST_F(LiveSessionTest, ACameraThatNeverComesEndsTheSessionWithItsReason) {
  switches_.is_there = false;
  LiveSessionOptions options = Rig::quick();
  options.ladder.patience = 0.1;
  Rig rig(live_cameras(), folder(), options);
  const Result<SessionEnd> end = rig.end();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().what, "no such camera");
  EXPECT_EQ(end.error().exit_code(), 1);
}

TEST_F(LiveSessionTest, ACameraThatIsGivenUpInMidPassLeavesAClosedPass) {
  {
    Rig rig(live_cameras(), folder());
    rig.press();
    rig.wait_for_frames(120);
    switches_.is_broken = true;
    const Result<SessionEnd> end = rig.end();
    ASSERT_FALSE(end);
  }
  switches_.is_broken = false;
  Rig rig(live_cameras(), folder());
  const LiveStatus status = rig.wait_for(State::between_passes);
  EXPECT_NE(status.notice.find("goes on: pass head is next"), std::string::npos) << status.notice;
}

TEST_F(LiveSessionTest, ACameraThatDoesNotSettleIsLockedAsItIs) {
  switches_.settles = false;
  Rig rig(live_cameras(), folder());
  rig.press();
  rig.wait_for(State::arming);
  const LiveStatus status = rig.wait_for(State::pass);
  EXPECT_NE(status.notice.find("did not settle"), std::string::npos) << status.notice;
}

TEST_F(LiveSessionTest, ADiskThatBecomesFullEndsThePassAndSaysSo) {
  std::atomic<std::uint64_t> room{std::uint64_t{1} << 30};
  LiveSessionOptions options = Rig::quick();
  options.room = [&]() -> Result<std::uint64_t> { return room.load(); };
  Rig rig(live_cameras(), folder(), options);
  rig.press();
  rig.wait_for_frames(120);
  room = 1 << 20;
  const LiveStatus fault = rig.wait_for(State::fault);
  EXPECT_NE(fault.fault.find("disk is nearly full"), std::string::npos) << fault.fault;
  EXPECT_NE(fault.notice.find("the pass was ended"), std::string::npos) << fault.notice;
  room = std::uint64_t{1} << 30;
  EXPECT_EQ(rig.wait_for(State::between_passes).pass, "head");
}

TEST_F(LiveSessionTest, AStopInMidPassClosesItAndTheNextStartGoesOn) {
  {
    Rig rig(live_cameras(), folder());
    rig.press();
    rig.wait_for_frames(120);
    rig.session().stop();
    ASSERT_TRUE(rig.end());
    EXPECT_EQ(*rig.end(), SessionEnd::stopped);
    EXPECT_EQ(rig.session().status().state, State::between_passes);
  }
  Rig rig(live_cameras(), folder());
  rig.wait_for(State::between_passes);
  rig.post(Kind::shut_down);
  EXPECT_EQ(rig.end(), SessionEnd::shut_down);
}

TEST_F(LiveSessionTest, WithoutAHostRecordingGoesOnAndTheScanWaits) {
  const std::shared_ptr<Spool> spool = Rig::open_spool(folder());
  UplinkOptions options;
  options.host = "tcp://127.0.0.1:9";  // nobody listens there
  options.keys = make_key_pair();
  options.host_public_key = make_key_pair().public_key;
  options.device_name = "rig";
  options.hello_timeout = std::chrono::milliseconds(50);
  const Uplink uplink(options, *spool);
  Rig rig(live_cameras(), folder(), Rig::quick(), &uplink, spool);
  const auto is_gone = [](const LiveStatus& status) { return status.is_raised(Condition::host_gone); };
  rig.wait_until(is_gone, "host gone");
  rig.press();
  rig.wait_for_frames(120);
  rig.press();
  const std::string scan = rig.wait_for(State::between_passes).scan;
  rig.post(Kind::cancel);
  EXPECT_EQ(rig.wait_for(State::waiting_for_host).scan, scan);
  rig.press();
  const LiveStatus next = rig.wait_for(State::pass);
  EXPECT_NE(next.scan, scan);
}

TEST_F(LiveSessionTest, APowerCutInArmingIsForgotten) {
  switches_.settles = false;
  Rig rig(live_cameras(), folder());
  rig.press();
  rig.wait_for(State::arming);
  const fs::path left = cut("left");
  Rig again(live_cameras(), left);
  again.wait_for(State::idle);
  EXPECT_TRUE(again.spool().scan_ids().empty());
}

TEST_F(LiveSessionTest, APowerCutInAPassKeepsWhatWasSpooledAndGoesOnWithTheNext) {
  fs::path left;
  {
    Rig rig(live_cameras(), folder());
    rig.press();
    rig.wait_until(
        [](const LiveStatus& status) { return status.state == State::pass && status.keyframes >= least_frames; },
        "keyframes");
    left = cut("left");
  }
  Rig again(live_cameras(), left);
  const LiveStatus status = again.wait_for(State::between_passes);
  EXPECT_NE(status.notice.find("goes on: pass head is next"), std::string::npos) << status.notice;
  EXPECT_NE(status.notice.find("was cut off and keeps its"), std::string::npos) << status.notice;
  again.post(Kind::cancel);
  again.wait_for(State::idle);
  expect_bundle(again.spool(), status.scan, 1);
}

TEST_F(LiveSessionTest, APowerCutInALastPassClosesTheScanAndSaysSo) {
  fs::path left;
  LiveSessionOptions options = Rig::quick();
  options.mode = "turn";
  std::string scan;
  {
    Rig rig(live_cameras(), folder(), options);
    rig.press();
    scan =
        rig.wait_until(
               [](const LiveStatus& status) { return status.state == State::pass && status.keyframes >= least_frames; },
               "keyframes")
            .scan;
    left = cut("left");
  }
  Rig again(live_cameras(), left, options);
  const LiveStatus status =
      again.wait_until([](const LiveStatus& now) { return !now.notice.empty(); }, "what became of it");
  EXPECT_EQ(status.state, State::idle);
  EXPECT_NE(status.notice.find("is closed with what it has"), std::string::npos) << status.notice;
  expect_bundle(again.spool(), scan, 1);
}

TEST_F(LiveSessionTest, APowerCutAtTheBeginningOfAPassTakesTooLittleBack) {
  record_body();
  const SessionStore store(folder());
  std::optional<StoredSession> stored = store.load();
  ASSERT_TRUE(stored && stored->scan);
  stored->state = State::pass;
  stored->scan->passes.push_back({"head", 30.0, 0, 96, 64, std::nullopt});
  ASSERT_TRUE(store.save(*stored));
  {
    const std::shared_ptr<Spool> spool = Rig::open_spool(folder());
    const std::string picture = "a picture";
    ASSERT_TRUE(spool->add_file(scan_, "frames/head-000003.jpg", std::as_bytes(std::span(picture))));
  }
  Rig again(live_cameras(), folder());
  const LiveStatus status = again.wait_for(State::between_passes);
  EXPECT_EQ(status.pass, "head");
  EXPECT_NE(status.notice.find("too few to be of use"), std::string::npos) << status.notice;
  again.post(Kind::cancel);
  again.wait_for(State::idle);
  expect_bundle(again.spool(), scan_, 1);
}

TEST_F(LiveSessionTest, APowerCutWhileTheScanIsClosedClosesIt) {
  record_body();
  say_state(folder(), State::finishing);
  Rig again(live_cameras(), folder());
  const LiveStatus status =
      again.wait_until([](const LiveStatus& now) { return !now.notice.empty(); }, "what became of it");
  EXPECT_EQ(status.state, State::idle);
  EXPECT_NE(status.notice.find("is closed with what it has"), std::string::npos) << status.notice;
  expect_bundle(again.spool(), scan_, 1);
}

TEST_F(LiveSessionTest, APowerCutWithLostRecordsStillClosesTheScan) {
  record_body();
  ASSERT_TRUE(write_file(folder() / "session" / (scan_ + "-body.jsonl"), std::string_view("not a record\n")));
  say_state(folder(), State::finishing);
  Rig again(live_cameras(), folder());
  again.wait_until([](const LiveStatus& now) { return !now.notice.empty(); }, "what became of it");
  expect_bundle(again.spool(), scan_, 1);
}

TEST_F(LiveSessionTest, APowerCutInAFaultGoesOnBetweenThePasses) {
  record_body();
  say_state(folder(), State::fault);
  Rig again(live_cameras(), folder());
  EXPECT_EQ(again.wait_for(State::between_passes).scan, scan_);
}

TEST_F(LiveSessionTest, AfterAPowerCutTheSameIsWaitedForAndShown) {
  record_body();
  for (const State state : {State::waiting_for_host, State::avatar_ready}) {
    say_state(folder(), state);
    Rig again(live_cameras(), folder());
    EXPECT_EQ(again.wait_for(state).scan, scan_);
    again.post(Kind::cancel);
    again.wait_for(State::idle);
    // For the next round.
    again.session().stop();
    ASSERT_TRUE(again.end());
    const SessionStore store(folder());
    StoredSession stored;
    stored.scan = read_scan(again.spool().bundle(scan_)).value();
    ASSERT_TRUE(store.save(stored));
  }
}

}  // namespace
}  // namespace gyre
