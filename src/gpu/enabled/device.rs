//! Selection and opening of a GPU.

use crate::gpu::{AdapterInfo, AdapterKind, GpuError};
use crossbeam_channel::{Receiver, bounded};
use std::sync::Arc;

/// Storage buffers that shaders bind besides the tables.
const OTHER_BUFFERS: u32 = 4;

/// An open GPU. Clones refer to the same device.
#[derive(Clone, Debug)]
pub struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    info: AdapterInfo,
    table_buffers: u32,
    /// The first error reported outside of any call that could return it; taken once.
    reports: Receiver<String>,
}

/// The adapters of this machine, best first.
pub fn adapters() -> Vec<AdapterInfo> {
    found().into_iter().map(|(info, _)| info).collect()
}

fn found() -> Vec<(AdapterInfo, wgpu::Adapter)> {
    let backends = wgpu::Backends::PRIMARY;
    let descriptor =
        wgpu::InstanceDescriptor { backends, ..wgpu::InstanceDescriptor::new_without_display_handle() };
    let instance = wgpu::Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(backends));
    let mut found: Vec<_> = adapters.into_iter().map(|adapter| (describe(&adapter), adapter)).collect();
    // The sort is stable: equal adapters keep the system's order.
    found.sort_by_key(|(info, _)| info.kind);
    found
}

fn describe(adapter: &wgpu::Adapter) -> AdapterInfo {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
        wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
        wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
        wgpu::DeviceType::Cpu => AdapterKind::Software,
        wgpu::DeviceType::Other => AdapterKind::Other,
    };
    let backend = match info.backend {
        wgpu::Backend::Vulkan => "Vulkan",
        wgpu::Backend::Metal => "Metal",
        wgpu::Backend::Dx12 => "DirectX 12",
        _ => "another interface",
    };
    AdapterInfo {
        name: info.name,
        kind,
        backend: backend.to_owned(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        max_binding: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        max_workgroup_size: limits
            .max_compute_workgroup_size_x
            .min(limits.max_compute_invocations_per_workgroup),
    }
}

impl Device {
    /// Opens the best adapter, or the best one whose name contains `name`, ignoring case.
    ///
    /// Fails if there is no adapter (no driver, or no loader for it), none with that name, or if the adapter provides
    /// no device.
    pub fn open(name: Option<&str>) -> Result<Device, GpuError> {
        let found = found();
        if found.is_empty() {
            return Err(GpuError::NoAdapter);
        }
        let wanted = name.unwrap_or("").to_lowercase();
        let available = found.iter().map(|(info, _)| info.to_string()).collect();
        let chosen = found.into_iter().find(|(info, _)| info.name.to_lowercase().contains(&wanted));
        let Some((info, adapter)) = chosen else {
            return Err(GpuError::NoSuchAdapter { wanted: name.unwrap_or("").to_owned(), available });
        };
        let unusable = |message: String| GpuError::Unusable { adapter: info.name.clone(), message };
        let limits = adapter.limits();
        if limits.max_storage_buffers_per_shader_stage <= OTHER_BUFFERS {
            let (has, needed) = (limits.max_storage_buffers_per_shader_stage, OTHER_BUFFERS + 1);
            return Err(unusable(format!("shaders see {has} buffers there, and {needed} are needed")));
        }
        let table_buffers = limits.max_storage_buffers_per_shader_stage - OTHER_BUFFERS;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("stride"),
            required_limits: limits,
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| unusable(error.to_string()))?;
        // By default, wgpu panics on uncaptured errors. The first report is the most useful.
        let (sender, reports) = bounded(1);
        let report = sender.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let _ = report.try_send(error.to_string());
        }));
        device.set_device_lost_callback(move |_, message| {
            let _ = sender.try_send(format!("the device was lost: {message}"));
        });
        Ok(Device { device, queue, info, table_buffers, reports })
    }

    /// The same device, as if its limits for a buffer binding and for the number of table buffers were lower.
    #[cfg(test)]
    pub(super) fn with_limits(mut self, bytes: u64, table_buffers: u32) -> Device {
        self.info.max_binding = bytes;
        self.table_buffers = table_buffers;
        self
    }

    /// The number of storage buffers available for tables.
    pub(super) fn table_buffers(&self) -> u32 {
        self.table_buffers
    }

    /// The description of the device.
    pub fn description(&self) -> &AdapterInfo {
        &self.info
    }

    /// The error for results that could not be read.
    pub(super) fn failure(&self, otherwise: &str) -> GpuError {
        let message = self.reports.try_recv().unwrap_or_else(|_| otherwise.to_owned());
        GpuError::Failed { adapter: self.info.name.clone(), message }
    }

    /// Returns an error if one has been reported.
    pub(super) fn check(&self) -> Result<(), GpuError> {
        if self.reports.is_empty() { Ok(()) } else { Err(self.failure("")) }
    }

    /// Runs `work` and returns any errors that wgpu finds in it.
    pub(super) fn checked<T>(&self, work: impl FnOnce(&wgpu::Device) -> T) -> Result<T, GpuError> {
        let scopes =
            [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Internal]
                .map(|filter| self.device.push_error_scope(filter));
        let done = work(&self.device);
        let mut first = None;
        // Scopes are popped in the reverse order of pushing.
        for scope in scopes.into_iter().rev() {
            first = pollster::block_on(scope.pop()).or(first);
        }
        match first {
            None => Ok(done),
            Some(error) => {
                Err(GpuError::Failed { adapter: self.info.name.clone(), message: error.to_string() })
            }
        }
    }
}
