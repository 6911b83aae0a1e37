//! The program that runs on the device.

use super::device::Device;
use super::heap::{FIRST_PAGE, Paging};
use super::tables::Tables;
use super::variant::{self, Plan, Variant};
use crate::gpu::{GpuError, Job};
use crate::scene::{Integrator, RenderSettings};

/// The hand-written WGSL that all integrators share, in the order of the CPU's rooms.
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

/// What only rendering needs.
pub(super) const MAIN: &str = include_str!("../main.wgsl");

/// Invocations in a workgroup, where the adapter takes that many.
const WORKGROUP_SIZE: u32 = 64;

/// The library of functions, without an entry point.
pub(super) fn library(variant: &Variant) -> String {
    let mut text = variant::text(variant);
    for source in SOURCES {
        text.push_str(source);
    }
    text + &variant.plan.recorded + steps(variant.integrator)
}

/// How a device is to be used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) workgroup_size: u32,
    /// The most workgroups in a dispatch.
    pub(super) workgroups: u32,
}

impl Shape {
    pub(super) fn of(device: &Device) -> Shape {
        let info = device.description();
        Shape {
            workgroup_size: WORKGROUP_SIZE.min(info.max_workgroup_size),
            workgroups: device.device.limits().max_compute_workgroups_per_dimension,
        }
    }
}

/// The program, compiled for a device; any scene of its plan can be put under it.
#[derive(Clone, Debug)]
pub(super) struct Program {
    pub(super) pipeline: wgpu::ComputePipeline,
    /// The layout of what lasts through a run.
    pub(super) tables: wgpu::BindGroupLayout,
    /// The layout of what a dispatch brings.
    pub(super) tasks: wgpu::BindGroupLayout,
    pub(super) shape: Shape,
    /// What its scenes have in common.
    pub(super) plan: Plan,
}

fn buffer_entry(binding: u32, ty: wgpu::BufferBindingType) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}

/// The text of the program for an integrator.
pub(super) fn text(render: &RenderSettings, workgroup_size: u32, plan: &Plan) -> String {
    library(&Variant { integrator: render.integrator, workgroup_size, plan: plan.clone() }) + MAIN
}

impl Program {
    /// The program for an integrator.
    pub(super) fn new(
        device: &Device,
        render: &RenderSettings,
        shape: Shape,
        plan: Plan,
    ) -> Result<Program, GpuError> {
        Program::from_source(device, &text(render, shape.workgroup_size, &plan), shape, plan)
    }

    /// The same with another text.
    pub(super) fn from_source(
        device: &Device,
        source: &str,
        shape: Shape,
        plan: Plan,
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
            Program { pipeline, tables, tasks, shape, plan }
        })
    }
}

/// The program for a job on a device that takes all tables in one buffer.
pub(super) fn of_job(job: &Job<'_>) -> Result<String, GpuError> {
    let tables = Tables::new(job)?;
    Ok(text(job.render, WORKGROUP_SIZE, &Plan::of_tables(&tables, Paging::ONE)))
}
