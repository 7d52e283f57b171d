// SPDX-License-Identifier: Apache-2.0
#include "common/http/operations.h"
#include "common/log/log.h"
#include "common/metrics/metrics.h"
#include "common/service/service_manager.h"
#include "device/calibration/calibration_file.h"
#include "device/camera/camera_device.h"
#include "device/camera/camera_name.h"
#include "device/host_notices.h"
#include "device/link_flags.h"
#include "device/page/device_page.h"
#include "device/page_flags.h"
#include "device/panel/panel.h"
#include "device/recorder_flags.h"
#include "device/session/live_session.h"
#include "device/spool/spool.h"
#include "device/stop_signals.h"
#include "device/uplink/link_metrics.h"
#include "device/uplink/uplink.h"
#include "device/verbs.h"

#include <spawn.h>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

extern char** environ;

namespace gyre {

namespace {

struct RunFlags {
  std::string camera;
  std::string head_camera;
  std::string mode = "orbit";
  std::string spool = (data_folder() / "spool").string();
  LinkFlags link;
  PageFlags page;
  RecorderFlags recorder;
  double height_mm = 0.0;
  std::string shut_down = "systemctl poweroff";
};

// A camera by its name; how it can be wrong is found out at once, and whether it is there later.
Result<CameraFactory> camera_named(const std::string& name) {
  if (const Result<CameraName> parsed = parse_camera_name(name); !parsed) return tl::unexpected(parsed.error());
  return CameraFactory([name] { return open_camera(name, Pace::recorded); });
}

Result<LiveSession::Cameras> cameras_of(const RunFlags& given) {
  LiveSession::Cameras cameras;
  if (given.camera.empty()) {
    return wrong_use("no camera is named", "", "give --camera, or camera = \"v4l2:/dev/...\" under [run] in --config");
  }
  Result<CameraFactory> usual = camera_named(given.camera);
  if (!usual) return tl::unexpected(usual.error());
  cameras[""] = std::move(*usual);
  if (given.head_camera.empty()) return cameras;
  Result<CameraFactory> head = camera_named(given.head_camera);
  if (!head) return tl::unexpected(head.error());
  cameras["head"] = std::move(*head);
  return cameras;
}

// Runs what switches the board off, without waiting for it.
int switch_off(const std::string& command) {
  spdlog::info("shutting down: {}", command);
  std::istringstream words(command);
  std::vector<std::string> parts;
  for (std::string word; words >> word;) parts.push_back(word);
  if (parts.empty()) return 0;
  std::vector<char*> arguments;
  for (std::string& part : parts) arguments.push_back(part.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, arguments[0], nullptr, nullptr, arguments.data(), environ);
  if (error == 0) return 0;
  return report_error(fail("cannot switch the device off", command + " (" + std::strerror(error) + ")",
                           "pull the plug; everything is on disk")
                          .value());
}

std::unique_ptr<Panel> open_panel(const PanelOptions& options, LiveSession& session) {
  if (options.is_empty()) return nullptr;
  std::vector<Error> troubles;
  const auto press = [&](OperatorCommand::Kind kind) { session.post({kind, std::nullopt}); };
  auto panel = std::make_unique<Panel>(options, press, troubles);
  for (const Error& trouble : troubles) spdlog::error("{}; going on without it", trouble.message());
  session.on_status([&panel = *panel](const LiveStatus& status) { panel.show(status); });
  return panel;
}

std::vector<HealthCheck> health_of(const LiveSession& session) {
  const auto camera = [&session]() -> std::optional<std::string> {
    const LiveStatus status = session.status();
    if (status.state == SessionState::fault) return status.fault;
    if (status.is_raised(Condition::camera_lost)) return "the camera does not answer";
    return std::nullopt;
  };
  const auto disk = [&session]() -> std::optional<std::string> {
    if (session.status().is_raised(Condition::disk_low)) return "the disk is nearly full";
    return std::nullopt;
  };
  return {{"camera", camera}, {"disk", disk}};
}

// Null when there is to be none. Errors (wrong use): a wrong address; else it cannot be had there.
Result<std::unique_ptr<DevicePage>> open_page(const RunFlags& given, const Spool& spool, LiveSession& session,
                                              const Metrics& metrics) {
  if (given.page.is_off()) return std::unique_ptr<DevicePage>();
  const Result<HttpOptions> http = page_options(given.page, given.spool);
  if (!http) return tl::unexpected(http.error());
  auto page = std::make_unique<DevicePage>(*http, spool, [&](const OperatorCommand& command) -> Result<void> {
    session.post(command);
    return {};
  });
  add_operations_routes(page->server(), metrics, health_of(session));
  if (const Result<void> started = page->start(); !started) return tl::unexpected(started.error());
  session.on_status([&session, &page = *page](const LiveStatus& status) {
    page.show(status);
    if (const std::optional<Preview> preview = session.preview()) page.preview(preview->image);
  });
  spdlog::info("the rig's page is on {}", page->address());
  return page;
}

// The service manager hears that the session goes on, and what the operator is told.
class Heartbeat {
 public:
  // ready: what a line on standard output says once the session is under way.
  Heartbeat(const ServiceManager& manager, nlohmann::json ready) : manager_(manager), ready_(std::move(ready)) {}

  void show(const LiveStatus& status) {
    const auto now = std::chrono::steady_clock::now();
    if (!last_) say_ready();
    constexpr std::chrono::seconds usual{5};
    const std::chrono::microseconds due = manager_.watchdog() ? *manager_.watchdog() / 4 : usual;
    if (last_ && now - *last_ < due) return;
    last_ = now;
    log(manager_.alive());
    log(manager_.status(std::string(name_of(status.state)) + ": " + std::string(status.signal.sentence)));
  }

 private:
  static void log(const Result<void>& told) {
    if (!told) spdlog::warn("{}", told.error().message());
  }
  void say_ready() const {
    std::printf("%s\n", ready_.dump().c_str());
    std::fflush(stdout);
    log(manager_.ready());
  }

  const ServiceManager& manager_;
  nlohmann::json ready_;
  std::optional<std::chrono::steady_clock::time_point> last_;
};

int run(const RunFlags& given, const PanelOptions& panel_options) {
  Result<LiveSession::Cameras> cameras = cameras_of(given);
  if (!cameras) return report_error(cameras.error());
  if (const Result<void> valid = panel_options.check(); !valid) return report_error(valid.error());
  LiveSessionOptions options;
  options.mode = given.mode;
  options.device = given.link.name;
  options.recorder = recorder_options(given.recorder);
  if (given.height_mm > 0.0) options.height_mm = given.height_mm;
  // Only of one camera: the lens belongs to the scan, not to its passes.
  if (given.head_camera.empty()) {
    const Result<std::optional<Camera>> lens = read_calibration(cameras_folder(), given.camera);
    if (!lens) return report_error(lens.error());
    options.camera = *lens;
  }
  if (const Result<void> valid = options.check(); !valid) return report_error(valid.error());

  // Before anything has threads, so that none of them gets the signals and no child the manager's address.
  const Result<ServiceManager> manager = ServiceManager::from_environment();
  if (!manager) return report_error(manager.error());
  LiveSession* to_stop = nullptr;
  std::mutex stopping;
  bool is_stopped = false;
  const StopSignals signals([&] {
    const std::lock_guard lock(stopping);
    is_stopped = true;
    if (to_stop != nullptr) to_stop->stop();
  });

  const Result<std::unique_ptr<Spool>> spool = Spool::open(given.spool);
  if (!spool) return report_error(spool.error());
  std::unique_ptr<Uplink> uplink;
  if (!given.link.host.empty()) {
    const Result<UplinkOptions> link = uplink_options(given.link);
    if (!link) return report_error(link.error());
    uplink = std::make_unique<Uplink>(*link, **spool);
  }
  LiveSession session(std::move(*cameras), **spool, given.spool, uplink.get(), options);

  Metrics metrics;
  add_process_metrics(metrics);
  add_link_metrics(metrics, **spool, uplink.get());
  std::unique_ptr<Panel> panel = open_panel(panel_options, session);
  Result<std::unique_ptr<DevicePage>> page = open_page(given, **spool, session, metrics);
  if (!page && (panel == nullptr || page.error().kind == Error::Kind::usage)) return report_error(page.error());
  if (!page) spdlog::error("{}; going on with the panel alone", page.error().message());
  std::optional<HostNotices> notices;
  if (uplink) {
    notices.emplace(*uplink);
    session.on_status([&notices](const LiveStatus& status) { notices->show(status); });
  }
  nlohmann::json ready = {{"name", given.link.name}};
  if (page && *page) ready["page"] = (*page)->address();
  Heartbeat heartbeat(*manager, std::move(ready));
  session.on_status([&heartbeat](const LiveStatus& status) { heartbeat.show(status); });

  {
    const std::lock_guard lock(stopping);
    to_stop = &session;
    if (is_stopped) session.stop();
  }
  const Result<SessionEnd> end = session.run();
  {
    const std::lock_guard lock(stopping);
    to_stop = nullptr;
  }
  if (const Result<void> told = manager->stopping(); !told) spdlog::warn("{}", told.error().message());
  if (page && *page) (*page)->stop();
  panel.reset();
  if (!end) return report_error(end.error());
  return *end == SessionEnd::shut_down ? switch_off(given.shut_down) : 0;
}

}  // namespace

void add_run_verb(CLI::App& app, Verb& chosen, const std::shared_ptr<PanelOptions>& panel) {
  const auto flags = std::make_shared<RunFlags>();
  CLI::App* verb = app.add_subcommand("run", "the rig's daemon: camera, button, lights, and scans on their way");
  verb->add_option("--camera", flags->camera, "the camera: libcamera:, libcamera:ID, v4l2:DEVICE or replay:PATH");
  verb->add_option("--head-camera", flags->head_camera, "camera of the head pass; default: the same");
  verb->add_option("--mode", flags->mode, "orbit: the camera goes around, body and head; turn: the person turns")
      ->check(CLI::IsMember({"orbit", "turn"}))
      ->capture_default_str();
  add_link_flags(*verb, flags->link);
  add_page_flags(*verb, flags->page);
  add_live_recorder_flags(*verb, flags->recorder);
  verb->add_option("--spool", flags->spool, "folder where scans are kept")->capture_default_str();
  verb->add_option("--height-mm", flags->height_mm, "stature of subjects, millimetres; 0: not known")
      ->check(CLI::Range(0.0, 3000.0))
      ->capture_default_str();
  verb->add_option("--shut-down", flags->shut_down, "command for a very long press of the button")
      ->capture_default_str();
  verb->callback([flags, panel, &chosen] { chosen = [flags, panel] { return run(*flags, *panel); }; });
}

}  // namespace gyre
