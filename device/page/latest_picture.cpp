// SPDX-License-Identifier: Apache-2.0
#include "device/page/latest_picture.h"

namespace gyre {

namespace {

constexpr std::chrono::milliseconds too_old{500};

}  // namespace

void LatestPicture::set(std::string jpeg) {
  auto picture = std::make_shared<const std::string>(std::move(jpeg));
  const std::scoped_lock lock(mutex_);
  latest_ = {latest_.number + 1, std::move(picture)};
  set_at_ = Clock::now();
  changed_.notify_all();
}

std::optional<LatestPicture::Numbered> LatestPicture::wait(std::uint64_t seen, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  ++waiting_;
  const bool came = changed_.wait_for(lock, timeout, [&] {
    return closed_ || (latest_.jpeg && latest_.number != seen && Clock::now() - set_at_ < too_old);
  });
  --waiting_;
  if (!came || closed_) return std::nullopt;
  return latest_;
}

bool LatestPicture::is_wanted() const {
  const std::scoped_lock lock(mutex_);
  return waiting_ > 0;
}

void LatestPicture::close() {
  const std::scoped_lock lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

}  // namespace gyre
