#include "blend/vulkan/device.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "blend/vulkan/device_impl.h"
#include "db/error.h"
#include "db/patch_surface.h"

namespace patchwork {

namespace {

constexpr const char* kValidation = "VK_LAYER_KHRONOS_validation";
// Subgroup operations came with 1.1; nothing later is needed.
constexpr std::uint32_t kVersion = VK_API_VERSION_1_1;

// VK_FALSE: the call that was complained about goes on.
VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                            VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  auto* impl = static_cast<Device::Impl*>(user);
  const std::scoped_lock lock(impl->mutex);
  impl->messages.emplace_back(data->pMessage ? data->pMessage : "");
  return VK_FALSE;
}

// Warnings too: what the layer calls bad for speed is mended or argued about, not ignored.
VkDebugUtilsMessengerCreateInfoEXT messenger_info(Device::Impl& impl) {
  VkDebugUtilsMessengerCreateInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  info.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageType =
      VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  info.pfnUserCallback = keep_message, info.pUserData = &impl;
  return info;
}

bool has_validation() {
  std::uint32_t n = 0;
  vkEnumerateInstanceLayerProperties(&n, nullptr);
  std::vector<VkLayerProperties> layers(n);
  vkEnumerateInstanceLayerProperties(&n, layers.data());
  return std::any_of(layers.begin(), layers.end(),
                     [](const auto& l) { return std::strcmp(l.layerName, kValidation) == 0; });
}

std::vector<const char*> pointers(const std::vector<std::string>& names) {
  std::vector<const char*> all;
  for (const std::string& n : names) all.push_back(n.c_str());
  return all;
}

void make_instance(Device::Impl& impl, bool validation, std::vector<const char*> extensions) {
  if (validation && !has_validation())
    throw Error("Vulkan", "its validation layer is missing", "install vulkan-validationlayers");
  VkApplicationInfo app{};
  app.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  app.pApplicationName = "patchwork", app.apiVersion = kVersion;
  VkDebugUtilsMessengerCreateInfoEXT listener = messenger_info(impl);
  // Hazards between dispatches and copies are found by the layer's synchronization checks alone.
  const VkValidationFeatureEnableEXT more = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  VkValidationFeaturesEXT features{};
  features.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT, features.pNext = &listener;
  features.enabledValidationFeatureCount = 1, features.pEnabledValidationFeatures = &more;
  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, info.pApplicationInfo = &app;
  if (validation) {
    info.pNext = &features;
    info.enabledLayerCount = 1, info.ppEnabledLayerNames = &kValidation;
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
  }
  info.enabledExtensionCount = std::uint32_t(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  VkInstance instance = VK_NULL_HANDLE;
  impl.check(vkCreateInstance(&info, nullptr, &instance), "starting Vulkan");
  impl.instance = vk::Instance({}, instance);
  if (!validation) return;
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(instance, "vkCreateDebugUtilsMessengerEXT"));
  VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
  if (create)
    impl.check(create(instance, &listener, nullptr, &messenger), "listening to the validation layer");
  impl.messenger = vk::Messenger(instance, messenger);
}

// The first family of queues that runs compute shaders and can say how long they took; better one that draws.
std::optional<std::uint32_t> computing_family(VkPhysicalDevice device) {
  std::uint32_t n = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &n, nullptr);
  std::vector<VkQueueFamilyProperties> families(n);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &n, families.data());
  for (const VkQueueFlags wanted : {VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT, VK_QUEUE_COMPUTE_BIT | 0})
    for (std::uint32_t f = 0; f < n; ++f)
      if ((families[f].queueFlags & wanted) == wanted && families[f].timestampValidBits > 0) return f;
  return {};
}

// What drawing needs beyond computing, where the device has it; `missing` says what it has not.
VkPhysicalDeviceFeatures drawing_features(VkPhysicalDevice device, std::uint32_t family,
                                          std::string& missing) {
  std::uint32_t n = 0;
  vkGetPhysicalDeviceQueueFamilyProperties(device, &n, nullptr);
  std::vector<VkQueueFamilyProperties> families(n);
  vkGetPhysicalDeviceQueueFamilyProperties(device, &n, families.data());
  VkPhysicalDeviceFeatures has{}, use{};
  vkGetPhysicalDeviceFeatures(device, &has);
  if (!(families[family].queueFlags & VK_QUEUE_GRAPHICS_BIT)) missing = "its queue does not draw";
  if (!has.tessellationShader) missing = "it does not tessellate";
  if (!has.multiDrawIndirect || !has.drawIndirectFirstInstance) missing = "it has no indirect draws";
  if (!has.shaderStorageImageExtendedFormats) missing = "its shaders write no images of two channels";
  use.tessellationShader = has.tessellationShader, use.multiDrawIndirect = has.multiDrawIndirect;
  use.drawIndirectFirstInstance = has.drawIndirectFirstInstance;
  use.fullDrawIndexUint32 = has.fullDrawIndexUint32;
  use.shaderStorageImageExtendedFormats = has.shaderStorageImageExtendedFormats;
  use.pipelineStatisticsQuery = has.pipelineStatisticsQuery, use.fillModeNonSolid = has.fillModeNonSolid;
  return use;
}

struct Candidate {
  VkPhysicalDevice device;
  VkPhysicalDeviceProperties properties;
  std::string why_not;  // empty: it fits

  std::string name() const { return properties.deviceName; }
  // The larger the better.
  int rank() const {
    switch (properties.deviceType) {
      case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
        return 4;
      case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
        return 3;
      case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
        return 2;
      default:
        return 1;
    }
  }
};

std::string reason_against(const Candidate& c) {
  VkPhysicalDeviceFeatures features{};
  vkGetPhysicalDeviceFeatures(c.device, &features);
  if (c.properties.apiVersion < kVersion) return "it has no Vulkan 1.1";
  if (!features.shaderFloat64) return "its shaders have no 64-bit floats";
  if (!computing_family(c.device)) return "it has no queue that computes and takes times";
  if (c.properties.limits.maxComputeWorkGroupInvocations < 256) return "its work groups are too small";
  return {};
}

std::vector<Candidate> candidates_of(const Device::Impl& impl) {
  std::uint32_t n = 0;
  impl.check(vkEnumeratePhysicalDevices(impl.instance.get(), &n, nullptr), "listing devices");
  std::vector<VkPhysicalDevice> devices(n);
  impl.check(vkEnumeratePhysicalDevices(impl.instance.get(), &n, devices.data()), "listing devices");
  std::vector<Candidate> all;
  for (VkPhysicalDevice d : devices) {
    Candidate c{d, {}, {}};
    vkGetPhysicalDeviceProperties(d, &c.properties);
    c.why_not = reason_against(c);
    all.push_back(std::move(c));
  }
  return all;
}

std::string lowered(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return s;
}

// A whole number is a place in the list, anything else a part of a name.
bool is_chosen(const std::string& choice, std::size_t number, const std::string& name) {
  std::size_t wanted = 0;
  const auto [end, bad] = std::from_chars(choice.data(), choice.data() + choice.size(), wanted);
  if (bad == std::errc() && end == choice.data() + choice.size()) return wanted == number;
  return lowered(name).find(lowered(choice)) != std::string::npos;
}

// The best of those that fit and are chosen; else an error that says why each was not taken.
const Candidate& choose(const std::vector<Candidate>& all, const std::string& choice) {
  const Candidate* best = nullptr;
  std::string reasons;
  for (std::size_t k = 0; k < all.size(); ++k) {
    std::string why = all[k].why_not;
    if (!choice.empty() && !is_chosen(choice, k, all[k].name())) why = "it is not \"" + choice + "\"";
    if (why.empty() && (!best || all[k].rank() > best->rank())) best = &all[k];
    reasons += (k ? ", " : "") + std::to_string(k) + " " + all[k].name() + " (" + why + ")";
  }
  if (best) return *best;
  throw Error("Vulkan", all.empty() ? "there is no device" : "no device fits: " + reasons,
              choice.empty() ? "install a driver, or lavapipe: mesa-vulkan-drivers"
                             : "PATCHWORK_DEVICE is a number or a part of a name");
}

// One queue does everything: copies and dispatches of one evaluator depend on each other anyway.
void make_device(Device::Impl& impl, const std::vector<const char*>& extensions) {
  const float priority = 1;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = impl.family, queue.queueCount = 1, queue.pQueuePriorities = &priority;
  impl.features = drawing_features(impl.physical, impl.family, impl.cannot_draw);
  impl.features.shaderFloat64 = VK_TRUE;
  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.queueCreateInfoCount = 1, info.pQueueCreateInfos = &queue, info.pEnabledFeatures = &impl.features;
  info.enabledExtensionCount = std::uint32_t(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  VkDevice device = VK_NULL_HANDLE;
  impl.check(vkCreateDevice(impl.physical, &info, nullptr, &device), "opening the device");
  impl.device = vk::LogicalDevice({}, device);
  vkGetDeviceQueue(device, impl.family, 0, &impl.queue);
}

}  // namespace

std::string vk::meaning(VkResult result) {
  switch (result) {
    case VK_ERROR_DEVICE_LOST:
      return "the device was lost";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "the device is out of memory";
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "the machine is out of memory";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "there is no driver";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "the driver could not start";
    default:
      return "Vulkan says " + std::to_string(int(result));
  }
}

void Device::Impl::check(VkResult result, const char* what) const {
  if (result >= 0) return;
  throw Error(name.empty() ? "Vulkan" : name, std::string(what) + ": " + vk::meaning(result),
              result == VK_ERROR_OUT_OF_DEVICE_MEMORY ? "ask for less memory, or use the CPU" : "");
}

Device::Device(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Device::~Device() {
  if (impl_->device) vkDeviceWaitIdle(impl_->get());
}

std::shared_ptr<Device> Device::open(const DeviceOptions& options) {
  auto impl = std::make_unique<Impl>();
  make_instance(*impl, options.validation, pointers(options.instance_extensions));
  const char* wish = std::getenv("PATCHWORK_DEVICE");
  const std::vector<Candidate> all = candidates_of(*impl);
  const Candidate& c = choose(all, !options.choice.empty() ? options.choice : wish ? wish : "");
  impl->physical = c.device, impl->properties = c.properties, impl->name = c.name();
  impl->family = *computing_family(c.device);
  vkGetPhysicalDeviceMemoryProperties(c.device, &impl->memory);
  make_device(*impl, pointers(options.device_extensions));
  return std::shared_ptr<Device>(new Device(std::move(impl)));
}

const std::string& Device::name() const { return impl_->name; }

std::vector<std::string> Device::messages() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->messages;
}

std::size_t Device::most_patches() const {
  constexpr std::size_t samples = PatchSurface::kSide * PatchSurface::kSide;
  // The slot of a patch travels as a float.
  return std::min(std::size_t{impl_->properties.limits.maxTexelBufferElements} / samples,
                  std::size_t{1} << 24);
}

}  // namespace patchwork
