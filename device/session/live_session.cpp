// SPDX-License-Identifier: Apache-2.0
#include "device/session/live_session.h"

#include "device/session/disk_watch.h"
#include "device/session/frame_pump.h"
#include "device/session/host_watch.h"
#include "device/session/open_scan.h"
#include "device/session/session_desk.h"
#include "device/session/showing.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

namespace gyre {

namespace {

constexpr std::chrono::milliseconds look_every{50};  // without a frame
constexpr double settle_grace = 5.0;                 // seconds that a camera may be late with its lock

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

Result<void> LiveSessionOptions::check() const {
  if (mode != "orbit" && mode != "turn") return wrong_use("no such mode", mode, "orbit or turn");
  if (settle.count() < 0) return wrong_use("the time to settle must not be negative");
  return ladder.check();
}

class LiveSession::Loop {
 public:
  Loop(Cameras cameras, Spool& spool, const std::filesystem::path& folder, const Uplink* uplink,
       LiveSessionOptions options)
      : cameras_(std::move(cameras)),
        spool_(spool),
        options_(std::move(options)),
        host_(spool, uplink),
        disk_(
            options_.room ? options_.room : [&spool] { return spool.room(); }, options_.least_room),
        scan_(spool, folder, {options_.mode, options_.device, options_.camera, options_.recorder}) {}

  SessionDesk& desk() { return desk_; }
  void stop() { is_stopped_ = true; }

  Result<SessionEnd> run() {
    use_camera();
    resume();
    spdlog::info("waiting for the button");
    while (!is_leaving_) {
      PumpNews news = pump_->next(look_every);
      now_ = now_s();
      look_at_disk();
      look_at_host();
      take_commands();
      arm_if_wanted();
      if (news.frame) take(std::move(*news.frame), news.time_zero);
      hear(news);
      settle();
      if (const std::optional<Error> trouble = scan_.trouble(); trouble && state_ == SessionState::pass) {
        say_fault(*trouble);
        happen(SessionEvent::storage_failed);
      }
      guide();
      publish();
      if (news.is_given_up) {
        happen(SessionEvent::camera_given_up);
        publish();
        return tl::unexpected(
            news.trouble.value_or(Error{"the camera does not come back", {}, "check its cable and power"}));
      }
      if (is_stopped_) leave();
    }
    publish();
    return end_;
  }

 private:
  // --- Events.

  SessionFacts facts() const {
    SessionFacts facts = scan_.facts();
    facts.has_host = host_.is_wanted();
    return facts;
  }

  void happen(SessionEvent event) {
    const SessionStep step = next_step(state_, event, facts());
    if (step.to == state_ && step.action == SessionAction::none) return;
    spdlog::info("{} on {}: {}", name_of(state_), name_of(event), name_of(step.to));
    state_ = step.to;
    if (step.action == SessionAction::arm) scan_.begin(next_height_ ? next_height_ : options_.height_mm);
    save();
    perform(step.action);
  }

  void save() {
    if (const Result<void> saved = scan_.save(state_); !saved) spdlog::error("{}", saved.error().message());
  }

  void perform(SessionAction action) {
    switch (action) {
      case SessionAction::none:
        return;
      case SessionAction::arm:
        next_height_.reset();
        notice_.clear();
        use_camera();
        wants_arming_ = true;
        armed_at_ = now_;
        arm_if_wanted();
        return;
      case SessionAction::disarm:
        wants_arming_ = false;
        pump_->disarm();
        return;
      case SessionAction::record:
        record();
        return;
      case SessionAction::close_pass:
        close_pass();
        return;
      case SessionAction::recover_pass:
        passed(scan_.recover_pass());
        return;
      case SessionAction::drop_pass:
        drop_pass();
        return;
      case SessionAction::close_scan:
        close_scan();
        return;
      case SessionAction::forget:
        scan_.forget();
        save();
        return;
    }
  }

  void resume() {
    state_ = scan_.restore();
    const SessionState before = state_;
    const std::string id = scan_.scan() ? scan_.scan()->id : std::string();
    if (before != SessionState::idle && !id.empty()) {
      notice("scan " + id + " was " + std::string(name_of(before)) + " when the device stopped");
    }
    happen(SessionEvent::restart);
    if (id.empty() || before == SessionState::idle) return;
    const std::optional<SpoolPhase> phase = spool_.phase(id);
    if (state_ == SessionState::between_passes) {
      notice("scan " + id + " goes on: pass " + scan_.pass() + " is next" + after_that());
    } else if (state_ != before && phase && *phase != SpoolPhase::recording) {
      notice("scan " + id + " was cut off and is closed with what it has" + after_that());
    } else if (state_ == SessionState::idle && recovered_.empty()) {
      notice("scan " + id + " had nothing recorded; the next start begins anew");
    }
  }

  // What the recovery said, for the same sentence.
  std::string after_that() const { return recovered_.empty() ? std::string() : "; " + recovered_; }

  void notice(const std::string& text) {
    spdlog::info("{}", text);
    notice_ = text;
  }

  void say_fault(const Error& error) {
    fault_ = error.message();
    is_passing_fault_ = false;
    spdlog::error("{}", fault_);
  }

  // --- What the states do.

  void use_camera() {
    const std::string key = cameras_.contains(scan_.pass()) ? scan_.pass() : std::string();
    if (pump_ && key == camera_) return;
    camera_ = key;
    pump_.reset();
    pump_ = std::make_unique<FramePump>(cameras_.at(key), options_.ladder);
  }

  void arm_if_wanted() {
    if (!wants_arming_) return;
    const Result<void> armed = pump_->arm(options_.settle);
    if (armed) {
      wants_arming_ = false;
    } else {
      armed_at_ = now_;
    }
  }

  void settle() {
    if (state_ != SessionState::arming || wants_arming_) return;
    if (pump_->locked() == CameraLock::held) {
      happen(SessionEvent::camera_settled);
    } else if (is_lost_) {
      armed_at_ = now_;
    } else if (now_ - armed_at_ > std::chrono::duration<double>(options_.settle).count() + settle_grace) {
      notice("the camera did not settle; its exposure is held as it is");
      happen(SessionEvent::settle_timeout);
    }
  }

  void record() {
    const std::optional<CameraInfo> camera = pump_->info();
    if (!camera) return;  // it has settled, so it was open
    scan_.start_pass(*camera);
    save();
    showing_.begin_pass(scan_.pass(), scan_.is_last_pass());
    first_time_.reset();
    count_ = 0;
  }

  void close_pass() {
    wants_arming_ = false;
    const Recall recall = [&](const auto& indices, const auto& take) {
      return pump_->with([&](CameraDevice& camera) { return camera.recall(indices, take); });
    };
    publish();
    passed(scan_.close_pass(recall));
    pump_->disarm();
  }

  void passed(const Result<ClosedPass>& closed) {
    if (!closed) {
      say_fault(closed.error());
      happen(SessionEvent::storage_failed);
      return;
    }
    recovered_ = closed->text;
    notice(closed->text);
    happen(closed->is_usable ? SessionEvent::pass_closed : SessionEvent::pass_unusable);
  }

  void drop_pass() {
    if (const Result<void> dropped = scan_.drop_pass(); !dropped) spdlog::error("{}", dropped.error().message());
    pump_->disarm();
    save();
  }

  void close_scan() {
    if (const Result<void> closed = scan_.close_scan(); !closed) {
      say_fault(closed.error());
      happen(SessionEvent::storage_failed);
      return;
    }
    happen(SessionEvent::scan_closed);
  }

  void leave() {
    happen(SessionEvent::shut_down);
    is_leaving_ = true;
  }

  // --- What comes from outside.

  void take_commands() {
    for (const OperatorCommand& command : desk_.take_commands()) {
      if (command.height_mm) next_height_ = command.height_mm;
      if (command.kind == OperatorCommand::Kind::shut_down) {
        end_ = SessionEnd::shut_down;
        leave();
        return;
      }
      happen(event_of(command.kind, state_));
    }
  }

  // Of a frame in a turn; nothing without a turntable, and of a camera without a clock.
  std::optional<double> turntable_at(double time, const std::optional<double>& time_zero) const {
    if (options_.turntable == nullptr || scan_.pass() != "turn" || !time_zero) return std::nullopt;
    return options_.turntable->at(time + *time_zero);
  }

  void take(Frame frame, const std::optional<double>& time_zero) {
    desk_.show(frame.image);
    if (state_ != SessionState::pass) {
      showing_.idle_frame(now_, frame.image);
      return;
    }
    const std::optional<double> turntable = turntable_at(frame.time, time_zero);
    if (!first_time_) first_time_ = frame.time;
    frame.index = count_++;
    frame.time -= *first_time_;
    scan_.add(std::move(frame), turntable);
    showing_.recorded_frame(now_, *scan_.recorder());
    if (scan_.recorder()->is_full()) end_full_pass();
  }

  // Somebody has forgotten it.
  void end_full_pass() {
    const int frames = scan_.recorder()->frames();
    happen(SessionEvent::recording_ended);
    notice("the pass was ended at " + std::to_string(frames) + " frames, the most a pass may have; " + notice_);
  }

  void hear(const PumpNews& news) {
    is_lost_ = news.is_lost;
    if (news.has_ended && !news.frame) happen(SessionEvent::recording_ended);
    if (is_lost_ && (state_ == SessionState::idle || state_ == SessionState::between_passes)) {
      fault_ = news.trouble ? news.trouble->message() : "no pictures come from the camera; check its cable and power";
      is_passing_fault_ = true;
      happen(SessionEvent::camera_lost);
    }
    if (state_ == SessionState::fault && is_passing_fault_ && !is_lost_ && !disk_.is_low()) {
      is_passing_fault_ = false;
      happen(SessionEvent::trouble_over);
    }
  }

  void look_at_disk() {
    const bool is_recording = state_ == SessionState::pass;
    disk_.look(now_, is_recording);
    if (!disk_.is_low() || state_ == SessionState::fault) return;
    fault_ = "this device's disk is nearly full (" + std::to_string(disk_.left() >> 20) +
             " MiB left for scans); let the host fetch what waits here, or free some space";
    is_passing_fault_ = true;
    happen(SessionEvent::disk_low);
    if (is_recording) notice("the pass was ended: " + fault_);
  }

  void look_at_host() {
    const std::optional<HostNews> news = host_.look(now_, scan_.scan(), state_ == SessionState::waiting_for_host);
    if (!news) return;
    if (news->event == SessionEvent::reconstruction_failed) {
      say_fault({news->text, {}, {}});
    } else if (!news->text.empty()) {
      notice(news->text);
    }
    happen(news->event);
  }

  // --- What is shown.

  void guide() { showing_.guide(now_, {state_ == SessionState::pass, !is_lost_, !disk_.is_low(), host_.is_there()}); }

  void publish() {
    LiveStatus status = showing_.status(now_, state_, scan_, host_);
    if (state_ == SessionState::fault) status.fault = fault_;
    status.notice = notice_;
    status.disk_free_mib = static_cast<double>(disk_.left()) / (1 << 20);
    desk_.tell(std::move(status));
  }

  Cameras cameras_;
  Spool& spool_;
  LiveSessionOptions options_;
  SessionDesk desk_;
  std::atomic<bool> is_stopped_{false};

  // Of the session's thread.
  HostWatch host_;
  DiskWatch disk_;
  OpenScan scan_;
  std::string camera_;  // name in cameras_ of the one that is open
  std::unique_ptr<FramePump> pump_;
  SessionState state_ = SessionState::idle;
  SessionEnd end_ = SessionEnd::stopped;
  bool is_leaving_ = false;
  double now_ = 0.0;
  double armed_at_ = 0.0;  // seconds
  bool wants_arming_ = false;
  bool is_lost_ = false;
  bool is_passing_fault_ = false;  // one that ends by itself
  std::string fault_, notice_, recovered_;
  std::optional<double> next_height_;  // of the scan that begins next, mm
  Showing showing_;
  std::optional<double> first_time_;  // of the pass, by the camera's clock
  int count_ = 0;                     // frames of the pass
};

LiveSession::LiveSession(Cameras cameras, Spool& spool, const std::filesystem::path& folder, const Uplink* uplink,
                         LiveSessionOptions options)
    : loop_(std::make_unique<Loop>(std::move(cameras), spool, folder, uplink, std::move(options))) {}

LiveSession::~LiveSession() = default;

void LiveSession::on_status(std::function<void(const LiveStatus&)> listener) {
  loop_->desk().on_status(std::move(listener));
}

void LiveSession::post(const OperatorCommand& command) {
  loop_->desk().post(command);
}

LiveStatus LiveSession::status() const {
  return loop_->desk().status();
}

std::optional<Preview> LiveSession::preview() const {
  return loop_->desk().preview();
}

Result<SessionEnd> LiveSession::run() {
  return loop_->run();
}

void LiveSession::stop() {
  loop_->stop();
}

}  // namespace gyre
