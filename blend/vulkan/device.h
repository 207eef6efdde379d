// The graphics card (or lavapipe in its place) that evaluates the surface.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace patchwork {

struct DeviceOptions {
  bool validation = false;  ///< the Khronos layer watches every call; see Device::messages
  std::string choice =
      {};  ///< a part of the device's name or its number; empty: PATCHWORK_DEVICE, else the best
  std::vector<std::string> instance_extensions = {}, device_extensions = {};  ///< what a window needs
};

/// One device with one queue. What is made from it keeps it alive. Not safe for concurrent use.
class Device {
 public:
  /// Throws Error: no device fits (with the reason of each), no such choice, validation without its layer.
  static std::shared_ptr<Device> open(const DeviceOptions& options = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const std::string& name() const;
  /// What the validation layer had to say so far, warnings included; a sound program leaves it empty.
  std::vector<std::string> messages() const;
  /// The most patches that the device's limits let a pool hold.
  std::size_t most_patches() const;

  struct Impl;  ///< device_impl.h
  Impl& impl() const { return *impl_; }

 private:
  explicit Device(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
