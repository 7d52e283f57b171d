// SPDX-License-Identifier: Apache-2.0
#include "device/session/frame_pump.h"

#include <spdlog/spdlog.h>
#include <utility>

namespace gyre {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t places = 8;                  // frames that may wait: a quarter of a second
constexpr std::chrono::milliseconds patience{50};  // for a frame, before somebody's task is looked for

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

}  // namespace

FramePump::FramePump(CameraFactory open, const LadderOptions& ladder)
    : open_(std::move(open)), ladder_(ladder), thread_(&FramePump::run, this) {}

FramePump::~FramePump() {
  {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

PumpNews FramePump::next(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  const auto is_news = [&] { return !frames_.empty() || (news_.has_ended && !is_end_told_) || news_.is_given_up; };
  changed_.wait_for(lock, timeout, is_news);
  PumpNews news = news_;
  if (frames_.empty()) {
    is_end_told_ = news.has_ended;
  } else {
    news.frame = std::move(frames_.front());
    frames_.pop_front();
    news.has_ended = false;  // first what came before
    lock.unlock();
    changed_.notify_all();
  }
  return news;
}

std::optional<CameraInfo> FramePump::info() const {
  const std::lock_guard lock(mutex_);
  return info_;
}

Result<void> FramePump::arm(std::chrono::milliseconds settle) {
  return with([&](CameraDevice& camera) -> Result<void> {
    {
      const std::lock_guard lock(mutex_);
      frames_.clear();
      news_.has_ended = is_end_told_ = false;
      is_rewound_ = true;
    }
    if (camera.info().expected_frames > 0) {
      camera.stop();
      if (const Result<void> started = camera.start(); !started) return started;
    }
    camera.unlock();
    camera.lock(settle);
    locked_ = camera.locked();
    return {};
  });
}

void FramePump::disarm() {
  const Result<void> done = with([&](CameraDevice& camera) -> Result<void> {
    camera.unlock();
    locked_ = camera.locked();
    return {};
  });
  if (!done) spdlog::debug("{}", done.error().message());
}

Result<void> FramePump::with(const std::function<Result<void>(CameraDevice&)>& task) {
  std::optional<Result<void>> done;
  std::unique_lock lock(mutex_);
  if (!is_over_) {
    tasks_.emplace_back([&] {
      Result<void> result = camera_ ? task(*camera_) : fail("the camera is away");
      const std::lock_guard inner(mutex_);
      done = std::move(result);
    });
    changed_.notify_all();
    changed_.wait(lock, [&] { return done.has_value(); });
  }
  return done ? *done : Result<void>(fail("the camera is away"));
}

// The mutex is held, but not while a task works.
void FramePump::do_tasks(std::unique_lock<std::mutex>& lock) {
  while (!tasks_.empty()) {
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    changed_.notify_all();
    lock.lock();
  }
}

void FramePump::run() {
  if (open()) {
    stream();
    camera_->stop();
  }
  camera_.reset();
  std::unique_lock lock(mutex_);
  do_tasks(lock);
  is_over_ = true;
  lock.unlock();
  changed_.notify_all();
}

void FramePump::tell(bool is_lost, const std::optional<Error>& trouble) {
  {
    const std::lock_guard lock(mutex_);
    news_.is_lost = is_lost;
    news_.trouble = trouble;
  }
  changed_.notify_all();
}

void FramePump::note_time_zero() {
  const std::optional<double> zero = camera_->time_zero();
  const std::lock_guard lock(mutex_);
  news_.time_zero = zero;
}

// Waits for a camera that is not there. False: in vain.
bool FramePump::open() {
  const Clock::time_point end = Clock::now() + seconds(ladder_.patience);
  for (bool is_first = true;; is_first = false) {
    Result<std::unique_ptr<CameraDevice>> camera = open_();
    Result<void> started;
    if (camera) started = (*camera)->start();
    std::unique_lock lock(mutex_);
    if (camera && started) {
      camera_ = std::move(*camera);
      info_ = camera_->info();
      news_.is_lost = false;
      news_.trouble.reset();
      return true;
    }
    const Error error = camera ? started.error() : camera.error();
    news_.is_lost = true;
    news_.trouble = error;
    if (error.kind == Error::Kind::usage || Clock::now() >= end) {
      news_.is_given_up = true;
      return false;
    }
    if (is_first) spdlog::warn("{}; waiting for it", error.message());
    changed_.notify_all();
    const Clock::time_point again = Clock::now() + seconds(ladder_.between_reopens);
    while (!is_stopped_ && Clock::now() < again) {
      do_tasks(lock);
      changed_.wait_until(lock, again, [&] { return is_stopped_ || !tasks_.empty(); });
    }
    if (is_stopped_) return false;
  }
}

void FramePump::stream() {
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      do_tasks(lock);
      if (is_stopped_) return;
      if (news_.has_ended) {
        changed_.wait(lock, [&] { return is_stopped_ || !tasks_.empty(); });
        continue;
      }
    }
    Result<CameraEvent> event = camera_->next(patience);
    locked_ = camera_->locked();
    if (!event) {
      const std::lock_guard lock(mutex_);
      news_.is_lost = news_.is_given_up = true;
      news_.trouble = event.error();
      return;
    }
    switch (event->kind) {
      case CameraEvent::Kind::frame:
        tell(false, std::nullopt);
        note_time_zero();
        push(std::move(*event->frame));
        break;
      case CameraEvent::Kind::timeout:
        if (event->recovering) tell(true, std::nullopt);
        break;
      case CameraEvent::Kind::ended: {
        const std::lock_guard lock(mutex_);
        news_.has_ended = true;
        break;
      }
    }
    changed_.notify_all();
  }
}

void FramePump::push(Frame frame) {
  std::unique_lock lock(mutex_);
  is_rewound_ = false;
  while (frames_.size() >= places && !is_stopped_) {
    if (info_->live) {
      frames_.pop_front();
      ++left_out_;
      continue;
    }
    changed_.wait(lock, [&] { return is_stopped_ || !tasks_.empty() || frames_.size() < places; });
    do_tasks(lock);
    if (is_rewound_) return;  // it is one of before
  }
  frames_.push_back(std::move(frame));
}

}  // namespace gyre
