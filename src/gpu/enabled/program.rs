//! The program that runs on the device.

use super::device::Device;
use super::heap::{FIRST_PAGE, Paging};
use super::tables::Tables;
use super::variant::{self, ProgramPlan, ProgramVariant};
use crate::gpu::{GpuError, Job};
use crate::scene::{Integrator, RenderSettings};

/// The hand-written WGSL that all integrators share, in the order of the CPU's modules.
const SOURCES: [&str; 11] = [
    include_str!("../bindings.wgsl"),
    include_str!("../math.wgsl"),
    include_str!("../shapes.wgsl"),
    include_str!("../triangles.wgsl"),
    include_str!("../textures.wgsl"),
    include_str!("../light_tree.wgsl"),
    include_str!("../world.wgsl"),
    include_str!("../tree.wgsl"),
    include_str!("../sums.wgsl"),
    include_str!("../splats.wgsl"),
    include_str!("../film.wgsl"),
];

/// The hand-written WGSL of one integrator.
fn steps(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::Path | Integrator::PathNaive => include_str!("../path.wgsl"),
        Integrator::Whitted => include_str!("../whitted.wgsl"),
    }
}

/// The WGSL that is needed only for rendering.
pub(super) const MAIN: &str = include_str!("../main.wgsl");

/// Invocations per workgroup, unless the adapter's limit is lower.
const WORKGROUP_SIZE: u32 = 64;

/// The library of functions, without an entry point.
pub(super) fn library(variant: &ProgramVariant) -> String {
    let mut text = variant::text(variant);
    for source in SOURCES {
        text.push_str(source);
    }
    text + &variant.plan.recorded + steps(variant.integrator)
}

/// The sizes of workgroups and dispatches.
#[derive(Clone, Copy, Debug)]
pub(super) struct DispatchLimits {
    pub(super) workgroup_size: u32,
    /// The maximum number of workgroups in a dispatch.
    pub(super) workgroups: u32,
}

impl DispatchLimits {
    pub(super) fn of(device: &Device) -> DispatchLimits {
        let info = device.description();
        DispatchLimits {
            workgroup_size: WORKGROUP_SIZE.min(info.max_workgroup_size),
            workgroups: device.device.limits().max_compute_workgroups_per_dimension,
        }
    }
}

/// The program, compiled for a device. It can be bound to any scene with the same plan.
#[derive(Clone, Debug)]
pub(super) struct Program {
    pub(super) pipeline: wgpu::ComputePipeline,
    /// The layout of the bindings that stay the same during a run.
    pub(super) tables: wgpu::BindGroupLayout,
    /// The layout of the bindings of a dispatch.
    pub(super) tasks: wgpu::BindGroupLayout,
    pub(super) dispatch_limits: DispatchLimits,
    /// The plan of its scenes.
    pub(super) plan: ProgramPlan,
}

fn buffer_entry(binding: u32, ty: wgpu::BufferBindingType) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}

/// The WGSL of the program for an integrator.
pub(super) fn text(render: &RenderSettings, workgroup_size: u32, plan: &ProgramPlan) -> String {
    library(&ProgramVariant { integrator: render.integrator, workgroup_size, plan: plan.clone() }) + MAIN
}

impl Program {
    /// The program for an integrator.
    pub(super) fn new(
        device: &Device,
        render: &RenderSettings,
        dispatch_limits: DispatchLimits,
        plan: ProgramPlan,
    ) -> Result<Program, GpuError> {
        Program::from_source(
            device,
            &text(render, dispatch_limits.workgroup_size, &plan),
            dispatch_limits,
            plan,
        )
    }

    /// Compiles a given text.
    pub(super) fn from_source(
        device: &Device,
        source: &str,
        dispatch_limits: DispatchLimits,
        plan: ProgramPlan,
    ) -> Result<Program, GpuError> {
        device.checked(|device| {
            let read = wgpu::BufferBindingType::Storage { read_only: true };
            let write = wgpu::BufferBindingType::Storage { read_only: false };
            let numbers = if plan.uniforms { wgpu::BufferBindingType::Uniform } else { read };
            let layout = |kinds: &[wgpu::BufferBindingType]| {
                let entries: Vec<_> = (0..).zip(kinds).map(|(i, kind)| buffer_entry(i, *kind)).collect();
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: None,
                    entries: &entries,
                })
            };
            let mut tables = vec![numbers, write];
            debug_assert_eq!(tables.len(), FIRST_PAGE as usize);
            tables.extend((0..plan.paging.pages).map(|_| read));
            let tables = layout(&tables);
            let tasks = layout(&[numbers, write, write, write]);
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("stride"),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: &[Some(&tables), Some(&tasks)],
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("stride"),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some("trace_slots"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
            Program { pipeline, tables, tasks, dispatch_limits, plan }
        })
    }
}

/// The program for a job on a device that binds all tables in one page.
pub(super) fn of_job(job: &Job<'_>) -> Result<String, GpuError> {
    let tables = Tables::new(job)?;
    Ok(text(job.render, WORKGROUP_SIZE, &ProgramPlan::of_tables(&tables, Paging::ONE)))
}
